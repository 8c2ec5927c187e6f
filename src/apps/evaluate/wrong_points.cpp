#include "src/apps/evaluate/wrong_points.hpp"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "src/core/voxel_key.hpp"

namespace unimapper::apps {
namespace {

/// Points of one kind and session, one of each voxel.
class ThinnedPoints {
 public:
  ThinnedPoints(ViewPoints& points, std::uint8_t session, float voxel_m)
      : points_(points), session_(session), voxel_m_(voxel_m) {}

  void add(const Eigen::Vector3f& position) {
    // Not finite, or beyond any map.
    if (!(position.cwiseAbs().maxCoeff() < 1e5F)) return;
    const VoxelIndex voxel = voxel_index(position, 1.0F / voxel_m_);
    if (!is_representable(voxel) || !taken_.insert(pack(voxel)).second) return;
    points_.push_back({position, session_, 0});
  }

 private:
  ViewPoints& points_;
  std::uint8_t session_;
  float voxel_m_;
  std::unordered_set<VoxelKey> taken_;
};

std::vector<std::optional<std::size_t>> poses_of_scans(const ScanPoses& poses) {
  std::vector<std::int64_t> stamps_ns;
  for (const evaluate::StampedPose& scan : poses.truth) stamps_ns.push_back(scan.stamp_ns);
  return evaluate::nearest_in_time(stamps_ns, poses.estimate);
}

}  // namespace

LabelErrors collect_wrong_points(evaluate::ScanSource& source, const ScanPoses& poses,
                                 float voxel_m, WrongPoints& points) {
  const auto nearest = poses_of_scans(poses);
  ThinnedPoints kept(points.false_static, poses.session, voxel_m);
  ThinnedPoints removed(points.false_dynamic, poses.session, voxel_m);
  LabelErrors errors;
  errors.scans = source.scan_count();
  for (std::size_t i = 0; i < errors.scans; ++i) {
    const evaluate::ScoredScan scan = source.scan(i);
    evaluate::score_scan(scan, errors.score);
    if (i >= nearest.size() || !nearest[i]) {
      ++errors.scans_placeless;
      continue;
    }
    const Pose& T_map_sensor = poses.estimate[*nearest[i]].T_world_sensor;
    for (std::size_t p = 0; p < scan.points.size(); ++p) {
      const evaluate::Truth truth = evaluate::truth_of(scan.truth[p]);
      const bool is_removed = evaluate::is_removed(scan.predicted[p]);
      if (truth == evaluate::Truth::kIgnored) continue;
      if (is_removed == (truth == evaluate::Truth::kDynamic)) continue;
      (is_removed ? removed : kept)
          .add((T_map_sensor * scan.points[p].cast<double>()).cast<float>());
    }
  }
  return errors;
}

}  // namespace unimapper::apps
