#include "bench/dynamic/octomap_baseline.hpp"

#include <octomap/octomap.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "ports/datasets/label_values.hpp"
#include "ports/datasets/writers.hpp"

namespace unimapper::bench {
namespace {

using datasets::kLabelDynamic;
using datasets::kLabelStatic;

double process_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

octomap::point3d to_octomap(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// Scans in the frame of the map: the world's axes, the first scan's position. OctoMap knows
/// single precision and 3 km around its origin only.
class MapScans {
 public:
  explicit MapScans(const datasets::Dataset& dataset)
      : dataset_(dataset), origin_(dataset.pose(0).translation) {}

  /// Reads a scan; calls `visit(i, point)` for its points that have a position.
  template <typename Visit>
  void for_each_point(std::size_t number, Visit visit) {
    dataset_.read_scan(number, scan_);
    const Pose& T_world_sensor = dataset_.pose(number);
    for (std::size_t i = 0; i < scan_.points.size(); ++i) {
      const datasets::Scan::Point& p = scan_.points[i];
      const Eigen::Vector3d point(Eigen::Vector3f(p.x, p.y, p.z).cast<double>());
      if (point.allFinite()) visit(i, to_octomap(T_world_sensor * point - origin_));
    }
  }
  /// Points of the scan read last.
  [[nodiscard]] std::size_t size() const { return scan_.points.size(); }
  [[nodiscard]] octomap::point3d sensor(std::size_t number) const {
    return to_octomap(dataset_.pose(number).translation - origin_);
  }

 private:
  const datasets::Dataset& dataset_;
  Eigen::Vector3d origin_;
  datasets::Scan scan_;
};

/// Free, and not merely unknown.
bool is_free(const octomap::OcTree& tree, const octomap::point3d& point) {
  const octomap::OcTreeNode* node = tree.search(point);
  return node != nullptr && !tree.isNodeOccupied(node);
}

void insert(MapScans& scans, std::size_t number, double max_range_m, octomap::OcTree& tree) {
  octomap::Pointcloud cloud;
  scans.for_each_point(number, [&](std::size_t, const octomap::point3d& p) { cloud.push_back(p); });
  // Leaves alone matter here, so the inner nodes are updated once, at the end.
  tree.insertPointCloud(cloud, scans.sensor(number), max_range_m, true);
}

}  // namespace

OctomapCost label_with_octomap(const datasets::Dataset& dataset, const OctomapOptions& options,
                               const std::filesystem::path& out) {
  OctomapCost cost;
  cost.scans = std::min(options.scans, dataset.scan_count());
  datasets::make_directory(out / "labels");
  if (cost.scans == 0) return cost;
  MapScans scans(dataset);
  octomap::OcTree tree(options.voxel_m);
  for (std::size_t s = 0; s < cost.scans; ++s) {
    const double before = process_ms();
    insert(scans, s, options.max_range_m, tree);
    const double spent = process_ms() - before;
    cost.cpu_ms += spent;
    cost.longest_ms = std::max(cost.longest_ms, spent);
  }
  const double before = process_ms();
  tree.updateInnerOccupancy();
  cost.cpu_ms += process_ms() - before;
  cost.tree_bytes = tree.memoryUsage();

  std::vector<std::uint32_t> labels;
  for (std::size_t s = 0; s < cost.scans; ++s) {
    labels.clear();
    scans.for_each_point(s, [&](std::size_t i, const octomap::point3d& point) {
      labels.resize(i, kLabelStatic);
      labels.push_back(is_free(tree, point) ? kLabelDynamic : kLabelStatic);
    });
    labels.resize(scans.size(), kLabelStatic);
    datasets::write_labels(out / "labels" / (dataset.scan_name(s) + ".label"), labels);
  }
  return cost;
}

}  // namespace unimapper::bench
