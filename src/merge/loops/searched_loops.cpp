// Loops of a merge that knows nothing but outcomes.
#include "searched_loops.hpp"

#include "loop_search.hpp"
#include "person_links.hpp"
#include "verification_rounds.hpp"

namespace unimapper::merge {

std::vector<LoopConstraint> SearchedLoops::within_sessions() {
  return known_.verify(find_intra_session_candidates(sessions_, config_.loops, config_.threads),
                       kDescriptorLimit, clouds_);
}

std::vector<LoopConstraint> SearchedLoops::between_sessions() {
  return verify_in_rounds(
      find_inter_session_candidates(sessions_, config_.loops), kSessionsPerKeyframe,
      [&](const auto& chosen) { return known_.verify(chosen, kDescriptorLimit, clouds_); });
}

std::vector<LoopConstraint> SearchedLoops::links() {
  return link_loops(statements_.links, known_, clouds_);
}

PlacementEvidence SearchedLoops::evaluate(const Placement& placement) {
  return placements_.evaluate(placement);
}

std::vector<LoopConstraint> SearchedLoops::near_each_other(
    const std::vector<LoopCandidate>& candidates) {
  return known_.verify(candidates, kRadiusLimit, clouds_);
}

}  // namespace unimapper::merge
