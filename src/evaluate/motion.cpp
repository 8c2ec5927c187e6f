// Scoring of dynamic points by their object's motion while it was seen.
#include <algorithm>
#include <iterator>
#include <map>

#include "dynamic.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper::evaluate {
namespace {

// Twice the size of a fine cell: the rings of a sparse sensor move over a standing object.
constexpr float kCellM = 0.4F;
// Motion is undefined for objects seen in fewer scans.
constexpr std::size_t kFewestScans = 4;

/// Cells and points of one object in one stretch of scans.
struct Sighting {
  std::size_t first_scan = 0;
  std::size_t last_scan = 0;
  std::vector<VoxelKey> first;  ///< sorted, as is `last`
  std::vector<VoxelKey> last;
  std::size_t object_class = 0;
  Tally tally;
};

bool stands(const Sighting& sighting) {
  if (sighting.last_scan - sighting.first_scan + 1 < kFewestScans) return false;
  std::vector<VoxelKey> common;
  std::set_intersection(sighting.first.begin(), sighting.first.end(), sighting.last.begin(),
                        sighting.last.end(), std::back_inserter(common));
  return 3 * common.size() >= std::min(sighting.first.size(), sighting.last.size());
}

/// The cell of a point, counted from `origin` so that single precision suffices.
VoxelKey cell_of(const Eigen::Vector3f& point, const Pose& T_world_sensor,
                 const Eigen::Vector3d& origin) {
  const Eigen::Vector3d p = T_world_sensor * point.cast<double>() - origin;
  return pack(voxel_index(p.cast<float>(), 1.0F / kCellM));
}

/// Counts the object's points as moving.
void add_moving(std::size_t object_class, const Tally& tally, MotionScore& score) {
  score.moving += tally;
  score.moving_by_class[object_class] += tally;
}

/// Adds a scan's dynamic points to the sightings of their objects; those without an object count
/// as moving.
void collect(const ScoredScan& scan, std::size_t number, const Eigen::Vector3d& origin,
             std::map<std::uint32_t, Sighting>& sightings, MotionScore& score) {
  std::map<std::uint32_t, std::vector<VoxelKey>> cells;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Truth truth = truth_of(scan.truth[i]);
    if (truth != Truth::kDynamic) continue;
    const std::uint32_t instance = scan.truth[i] >> 16U;
    Tally point;
    point.add(truth, is_removed(scan.predicted[i]));
    if (instance == 0) {
      add_moving(class_of(scan.truth[i]), point, score);
      continue;
    }
    sightings[instance].tally += point;
    sightings[instance].object_class = class_of(scan.truth[i]);
    cells[instance].push_back(cell_of(scan.points[i], scan.T_world_sensor, origin));
  }
  for (auto& [instance, keys] : cells) {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    Sighting& sighting = sightings[instance];
    if (sighting.first.empty()) {
      sighting.first = keys;
      sighting.first_scan = number;
    }
    sighting.last = std::move(keys);
    sighting.last_scan = number;
  }
}

}  // namespace

MotionScore score_by_motion(ScanSource& source, std::size_t stretch) {
  MotionScore score;
  for (std::size_t begin = 0; begin < source.scan_count(); begin += stretch) {
    std::map<std::uint32_t, Sighting> sightings;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    for (std::size_t s = begin; s < std::min(begin + stretch, source.scan_count()); ++s) {
      const ScoredScan scan = source.scan(s);
      if (s == begin) {
        // A whole number of cells, so that stretches share their cells.
        origin = (scan.T_world_sensor.translation / 100.0).array().round() * 100.0;
      }
      collect(scan, s, origin, sightings, score);
    }
    for (const auto& [instance, sighting] : sightings) {
      if (stands(sighting)) {
        score.standing += sighting.tally;
      } else {
        add_moving(sighting.object_class, sighting.tally, score);
      }
    }
  }
  return score;
}

}  // namespace unimapper::evaluate
