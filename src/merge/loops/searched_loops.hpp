// Loops of a merge that knows nothing but outcomes.
#pragma once

#include <vector>

#include "loop_fingerprint.hpp"
#include "loop_source.hpp"
#include "src/merge/placements/known_placements.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "unimapper/merge/loop_outcomes.hpp"
#include "unimapper/merge/user_statements.hpp"
#include "verified_loops.hpp"

namespace unimapper::merge {

/// Searches all sessions and verifies every candidate that is needed.
class SearchedLoops final : public LoopSource {
 public:
  /// All of them must outlive it; `outcomes` may be null.
  SearchedLoops(const std::vector<SessionData>& sessions, const MergeConfig& config,
                const UserStatements& statements, KeyframeClouds& clouds,
                LoopFingerprints& fingerprints, LoopOutcomes* outcomes)
      : sessions_(sessions),
        config_(config),
        statements_(statements),
        clouds_(clouds),
        known_(config, statements, fingerprints, outcomes),
        placements_({sessions, clouds, config}, fingerprints, outcomes) {}

  std::vector<LoopConstraint> within_sessions() override;
  std::vector<LoopConstraint> between_sessions() override;
  std::vector<LoopConstraint> links() override;
  PlacementEvidence evaluate(const Placement& placement) override;
  std::vector<LoopConstraint> near_each_other(
      const std::vector<LoopCandidate>& candidates) override;

 private:
  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  const UserStatements& statements_;
  KeyframeClouds& clouds_;
  KnownLoops known_;
  KnownPlacements placements_;
};

}  // namespace unimapper::merge
