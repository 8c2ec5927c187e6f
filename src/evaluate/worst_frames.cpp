#include "worst_frames.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

namespace unimapper::evaluate {

std::vector<DynamicScore> score_frames(ScanSource& source) {
  std::vector<DynamicScore> frames(source.scan_count());
  for (std::size_t s = 0; s < frames.size(); ++s) score_scan(source.scan(s), frames[s]);
  return frames;
}

std::vector<std::size_t> worst_frames(std::span<const DynamicScore> frames, std::size_t count,
                                      std::size_t gap) {
  std::vector<std::size_t> order(frames.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return frames[a].total.wrong() > frames[b].total.wrong();
  });
  std::vector<std::size_t> worst;
  for (const std::size_t frame : order) {
    if (worst.size() >= count || frames[frame].total.wrong() == 0) break;
    const bool is_near_another = std::any_of(worst.begin(), worst.end(), [&](std::size_t other) {
      return std::max(frame, other) - std::min(frame, other) < gap;
    });
    if (!is_near_another) worst.push_back(frame);
  }
  return worst;
}

std::vector<ObjectErrors> errors_by_object(const ScoredScan& scan) {
  std::map<std::uint32_t, ObjectErrors> objects;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Truth truth = truth_of(scan.truth[i]);
    const Eigen::Vector3f& point = scan.points[i];
    if (truth == Truth::kIgnored || !point.allFinite()) continue;
    ObjectErrors& object = objects[scan.truth[i]];
    object.label = scan.truth[i];
    const bool removed = is_removed(scan.predicted[i]);
    object.tally.add(truth, removed);
    object.center += point.cast<double>();
    if (removed == (truth == Truth::kDynamic)) continue;
    object.wrong_center_sensor += point;
    object.wrong_range_m += point.norm();
  }
  std::vector<ObjectErrors> sorted;
  for (auto& [label, object] : objects) {
    const std::uint64_t points = object.tally.static_points + object.tally.dynamic_points;
    const float wrong = static_cast<float>(std::max<std::uint64_t>(1, object.tally.wrong()));
    object.center = scan.T_world_sensor * (object.center / static_cast<double>(points));
    object.wrong_center_sensor /= wrong;
    object.wrong_range_m /= wrong;
    sorted.push_back(object);
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const ObjectErrors& a, const ObjectErrors& b) {
    return a.tally.wrong() > b.tally.wrong();
  });
  return sorted;
}

double displacement_m(const ObjectErrors& object, std::span<const ObjectErrors> other_scan) {
  const auto same =
      std::find_if(other_scan.begin(), other_scan.end(),
                   [&](const ObjectErrors& other) { return other.label == object.label; });
  if (same == other_scan.end() || object.label >> 16U == 0) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return (object.center - same->center).norm();
}

}  // namespace unimapper::evaluate
