#include "placement_memory.hpp"

#include <algorithm>
#include <utility>

namespace unimapper::merge {
namespace {

constexpr const char* kAwaitsCheck = "its place in the map waits for a check of sensor data";
/// More keyframes than at the last check: fewer have little to say.
constexpr std::size_t kFewKeyframes = 8;

bool is_in_favour(const PlacementEvidence& evidence, const AcceptanceConfig& config) {
  return evidence.aliasing.empty() && evidence.supporting >= config.min_loops &&
         evidence.contradicting <= evidence.supporting;
}

}  // namespace

void PlacementMemory::begin(std::uint32_t checks, bool is_idle) {
  ++merge_;
  checks_left_ = checks;
  // Nobody asked: what the sessions have grown by says nothing about them.
  if (renewed_) known_.at(*renewed_).keyframes = keyframes_of(*renewed_);
  renewed_.reset();
  if (!is_waiting_) {
    for (const auto& [pair, known] : known_) {
      if (!is_due(pair, known, is_idle)) continue;
      if (!renewed_ || known.merge < known_.at(*renewed_).merge) renewed_ = pair;
    }
  }
  is_waiting_ = false;
}

PlacementEvidence PlacementMemory::evaluate(const Placement& placement,
                                            KnownPlacements& placements) {
  const Pair pair{placement.loops.front().query.session, placement.loops.front().match.session};
  const auto known = known_.find(pair);
  const bool holds = known != known_.end() && is_where(known->second, placement);
  if (holds && renewed_ != pair) return known->second.evidence;
  if (checks_left_ == 0) {
    is_waiting_ = true;
    if (holds) return known->second.evidence;
    PlacementEvidence none;
    none.aliasing = kAwaitsCheck;
    return none;
  }
  --checks_left_;
  PlacementEvidence evidence = placements.evaluate(placement);
  learn(placement, evidence);
  return evidence;
}

void PlacementMemory::learn(const Placement& placement, const PlacementEvidence& evidence) {
  const Pair pair{placement.loops.front().query.session, placement.loops.front().match.session};
  if (renewed_ == pair) renewed_.reset();
  std::vector<Pose> competing;
  for (const CompetingPlacement& other : placement.competing) {
    competing.push_back(other.T_match_session_query_session);
  }
  known_[pair] = {placement.T_match_session_query_session, std::move(competing), evidence,
                  keyframes_of(pair), merge_};
}

bool PlacementMemory::has_more() const {
  return is_waiting_ || std::any_of(known_.begin(), known_.end(), [&](const auto& known) {
           return is_due(known.first, known.second, true);
         });
}

bool PlacementMemory::is_due(const Pair& pair, const Known& known, bool is_idle) const {
  const std::size_t grown = keyframes_of(pair) - std::min(keyframes_of(pair), known.keyframes);
  if (is_idle) return grown > 0;
  if (grown < kFewKeyframes) return false;
  return 4 * grown >= known.keyframes || !is_in_favour(known.evidence, config_.acceptance);
}

/// Where the loops are, which is far from the origins of both frames; and what competes is where
/// it was.
bool PlacementMemory::is_where(const Known& known, const Placement& placement) const {
  const auto is_near = [&](const Pose& a, const Pose& b) {
    return std::all_of(placement.loops.begin(), placement.loops.end(), [&](const auto& loop) {
      const Eigen::Vector3d& query =
          placement.T_query_session_keyframe[loop.query.keyframe].translation;
      return (a * query - b * query).norm() <= AcceptanceConfig::kConfirmingSigmaM;
    });
  };
  const auto was_known = [&](const CompetingPlacement& other) {
    return std::any_of(known.competing.begin(), known.competing.end(), [&](const Pose& before) {
      return is_near(other.T_match_session_query_session, before);
    });
  };
  // The words may be about a placement that competes no more.
  const bool is_stale =
      !known.evidence.aliasing.empty() && known.competing.size() != placement.competing.size();
  return !is_stale && is_near(known.T_match_query, placement.T_match_session_query_session) &&
         std::all_of(placement.competing.begin(), placement.competing.end(), was_known);
}

std::size_t PlacementMemory::keyframes_of(const Pair& pair) const {
  return sessions_[pair.first].keyframes.size() + sessions_[pair.second].keyframes.size();
}

}  // namespace unimapper::merge
