// Scoring of dynamic points from the moment their object first begins to move.
#include <algorithm>
#include <map>

#include "dynamic.hpp"

namespace unimapper::evaluate {
namespace {

/// What a robot can know of one object.
struct ObjectState {
  std::size_t first_seen = 0;
  bool has_begun = false;
  bool moves_now = false;
};

using Intervals = std::multimap<std::uint32_t, MotionInterval>;

ObjectState state_at(std::size_t scan, std::size_t first_seen, std::uint32_t object,
                     const Intervals& intervals) {
  ObjectState state{first_seen, false, false};
  const auto [begin, end] = intervals.equal_range(object);
  for (auto at = begin; at != end; ++at) {
    const MotionInterval& interval = at->second;
    if (interval.first_scan > scan || interval.last_scan < first_seen) continue;
    state.has_begun = true;
    state.moves_now = state.moves_now || interval.last_scan >= scan;
  }
  return state;
}

void add_point(DynamicScore& score, Truth truth, std::uint32_t label, float range_m, bool removed) {
  score.total.add(truth, removed);
  score.by_class[class_of(label)].add(truth, removed);
  score.by_range[range_bin(range_m)].add(truth, removed);
}

}  // namespace

SinceMotionScore score_since_motion(ScanSource& source, std::span<const MotionInterval> motions) {
  Intervals intervals;
  for (const MotionInterval& motion : motions) intervals.emplace(motion.object, motion);
  std::map<std::uint32_t, std::size_t> first_seen;
  SinceMotionScore score;
  for (std::size_t s = 0; s < source.scan_count(); ++s) {
    const ScoredScan scan = source.scan(s);
    std::map<std::uint32_t, ObjectState> states;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const Truth truth = truth_of(scan.truth[i]);
      if (truth == Truth::kIgnored || !scan.points[i].allFinite()) {
        ++score.since.ignored;
        continue;
      }
      const std::uint32_t object = scan.truth[i] >> 16U;
      auto found = states.find(object);
      if (found == states.end()) {
        const std::size_t seen = first_seen.try_emplace(object, s).first->second;
        found = states.emplace(object, state_at(s, seen, object, intervals)).first;
      }
      const bool has_begun = found->second.has_begun || (object == 0 && truth == Truth::kDynamic);
      const bool removed = is_removed(scan.predicted[i]);
      if (!has_begun && truth == Truth::kDynamic) {
        score.before.add(Truth::kDynamic, removed);
        continue;
      }
      const Truth since = has_begun ? Truth::kDynamic : Truth::kStatic;
      add_point(score.since, since, scan.truth[i], scan.points[i].norm(), removed);
      if (!has_begun) continue;
      (found->second.moves_now || object == 0 ? score.moving : score.paused).add(since, removed);
    }
  }
  return score;
}

}  // namespace unimapper::evaluate
