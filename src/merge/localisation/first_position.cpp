// First position of a robot in a map, by the rules between sessions.
#include "first_position.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "src/merge/placements/placement_check.hpp"
#include "src/merge/sessions/seen_extent.hpp"

namespace unimapper::merge {
namespace {

// Loops that a first position may rest on lie within so much path.
constexpr double kWindow_m = 300.0;
constexpr std::size_t kMostLoops = 150;
// Two sets of loops that place the robot farther apart contradict each other.
constexpr double kApart_m = 3.0;

std::vector<LoopConstraint> chosen(const std::vector<LoopConstraint>& loops,
                                   std::span<const std::size_t> indices) {
  std::vector<LoopConstraint> some;
  some.reserve(indices.size());
  for (const std::size_t i : indices) some.push_back(loops[i]);
  return some;
}

}  // namespace

FirstPosition::FirstPosition(const std::vector<SessionData>& sessions,
                             const std::vector<SessionPath>& map_paths, KeyframeClouds& clouds,
                             const MergeConfig& config)
    : sessions_(sessions),
      map_paths_(map_paths),
      clouds_(clouds),
      config_(config),
      loops_(map_paths.size()),
      asked_(map_paths.size()),
      refused_(map_paths.size()) {
  for (std::size_t s = 0; s < map_paths.size(); ++s) {
    extents_m_.push_back(seen_extent_m(sessions[s]));
  }
}

void FirstPosition::clear() {
  for (auto& of_session : loops_) of_session.clear();
  asked_.assign(asked_.size(), {});
}

void FirstPosition::forget_first(std::size_t count) {
  for (auto& of_session : loops_) forget_first_queries(of_session, count);
}

AcceptanceConfig FirstPosition::rules(std::size_t session, double robot_extent_m) const {
  const double of_map_m = extents_m_[session];
  const bool both_known = robot_extent_m > 0.0 && of_map_m > 0.0;
  return scaled_to_extent(config_.acceptance,
                          both_known ? std::max(robot_extent_m, of_map_m) : 0.0);
}

void FirstPosition::keep_window(std::vector<LoopConstraint>& loops, const SessionPath& path) const {
  const double from_m = path.length_m() - kWindow_m;
  std::erase_if(loops, [&](const auto& l) { return path.path_m(l.query.keyframe) < from_m; });
  if (loops.size() <= kMostLoops) return;
  loops.erase(loops.begin(), loops.end() - static_cast<std::ptrdiff_t>(kMostLoops));
}

FirstPosition::Outcome FirstPosition::find(std::vector<LoopConstraint> loops,
                                           const SessionPath& path) {
  for (LoopConstraint& loop : loops) loops_[loop.match.session].push_back(std::move(loop));
  const double extent_m = seen_extent_m(sessions_.back());
  std::vector<ConsistencySet> sets;
  for (std::size_t s = 0; s < loops_.size(); ++s) {
    keep_window(loops_[s], path);
    sets.push_back(inter_session_consistency(loops_[s], path, map_paths_[s], rules(s, extent_m)));
  }
  const auto best = std::max_element(sets.begin(), sets.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.state, a.is_short, a.distinct) <
           std::tuple(b.state, b.is_short, b.distinct);
  });
  const auto session = static_cast<std::size_t>(best - sets.begin());
  Outcome outcome;
  outcome.reason = best->reason;
  if (best->state == PairState::kRefused && !best->is_short) return outcome;
  outcome.state = best->is_short ? LocalisationState::kNotYet : LocalisationState::kAmbiguous;
  const bool data_may_tell = best->is_short || !best->competing_sets.empty();
  if (best->state != PairState::kConfirmed && !data_may_tell) return outcome;
  outcome.loops = chosen(loops_[session], best->inliers);
  outcome.reason = contradiction_by_others(sets, session, path[path.size() - 1]);
  if (outcome.reason.empty()) {
    outcome.reason = reason_by_data(session, *best, outcome.loops, path);
  }
  if (!outcome.reason.empty()) {
    outcome.loops.clear();
    return outcome;
  }
  std::stable_sort(outcome.loops.begin(), outcome.loops.end(), [](const auto& a, const auto& b) {
    return a.query.keyframe < b.query.keyframe;
  });
  outcome.state = LocalisationState::kLocalised;
  outcome.rules = rules(session, extent_m);
  clear();
  return outcome;
}

/// Another session of the map would place the robot elsewhere.
std::string FirstPosition::contradiction_by_others(const std::vector<ConsistencySet>& sets,
                                                   std::size_t session, const Pose& here) const {
  const auto place = [&](const ConsistencySet& set) -> Eigen::Vector3d {
    return (set.T_match_session_query_session * here).translation;
  };
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const bool competes = s != session && sets[s].distinct >= 2 &&
                          static_cast<double>(sets[session].distinct) <
                              config_.acceptance.margin * static_cast<double>(sets[s].distinct);
    if (competes && (place(sets[s]) - place(sets[session])).norm() > kApart_m) {
      return "ambiguous: sessions of the map place the robot apart";
    }
  }
  return {};
}

/// What the sensor data say; not asked again before the set, or the path it spans, has grown.
std::string FirstPosition::reason_by_data(std::size_t session, const ConsistencySet& set,
                                          const std::vector<LoopConstraint>& inliers,
                                          const SessionPath& path) {
  Asked& asked = asked_[session];
  const bool has_grown = set.distinct > asked.distinct || (asked.is_short && !set.is_short);
  if (!has_grown) return refused_[session];
  asked = {set.distinct, set.is_short};
  std::vector<CompetingPlacement> competing;
  for (const ConsistencySet& other : set.competing_sets) {
    competing.push_back(
        {chosen(loops_[session], other.inliers), other.T_match_session_query_session});
  }
  PlacementEvaluator evaluator(sessions_, clouds_, config_);
  const PlacementEvidence evidence = evaluator.evaluate({inliers,
                                                         path.poses(),
                                                         map_paths_[session].poses(),
                                                         set.T_match_session_query_session,
                                                         {},
                                                         competing,
                                                         set.is_short});
  refused_[session] = reason_to_wait(set, evidence, config_.acceptance);
  return refused_[session];
}

void forget_first_queries(std::vector<LoopConstraint>& loops, std::size_t count) {
  std::erase_if(loops, [&](const auto& loop) { return loop.query.keyframe < count; });
  for (LoopConstraint& loop : loops) {
    loop.query = {loop.query.session, loop.query.keyframe - count};
  }
}

}  // namespace unimapper::merge
