#include "known_placements.hpp"

#include <optional>

namespace unimapper::merge {

PlacementEvidence KnownPlacements::evaluate(const Placement& placement) {
  if (outcomes_ == nullptr) return evaluator_.evaluate(placement);
  const LoopConstraint& first = placement.loops.front();
  const PlacementQuestion question{static_cast<std::uint32_t>(first.query.session),
                                   static_cast<std::uint32_t>(first.match.session),
                                   fingerprints_.of(placement)};
  if (auto known = outcomes_->find(question)) {
    // The question names competing placements; the evidence would have words for one that is not
    // excluded.
    known->competing_excluded = known->aliasing.empty() ? placement.competing.size() : 0;
    return *known;
  }
  PlacementEvidence evidence = evaluator_.evaluate(placement);
  outcomes_->keep(question, evidence);
  return evidence;
}

}  // namespace unimapper::merge
