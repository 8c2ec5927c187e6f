// Check of those placements whose evidence is not known.
#pragma once

#include "placement_check.hpp"
#include "src/merge/loops/loop_fingerprint.hpp"
#include "unimapper/merge/loop_outcomes.hpp"

namespace unimapper::merge {

/// `PlacementEvaluator::evaluate` with a memory: the result is the same, whatever is known.
class KnownPlacements {
 public:
  /// `outcomes` may be null: nothing is known and nothing kept.
  KnownPlacements(PlacementEvaluator evaluator, LoopFingerprints& fingerprints,
                  LoopOutcomes* outcomes)
      : evaluator_(evaluator), fingerprints_(fingerprints), outcomes_(outcomes) {}

  /// As `PlacementCheck`.
  [[nodiscard]] PlacementEvidence evaluate(const Placement& placement);

 private:
  PlacementEvaluator evaluator_;
  LoopFingerprints& fingerprints_;
  LoopOutcomes* outcomes_;
};

}  // namespace unimapper::merge
