// Verification of those loop candidates whose outcome is not known, and obedience to people.
#pragma once

#include <span>
#include <vector>

#include "loop_fingerprint.hpp"
#include "loop_verifier.hpp"
#include "unimapper/merge/loop_outcomes.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// `verify_loops` with a memory: the result is the same to the bit, whatever is known.
class KnownLoops {
 public:
  /// `outcomes` may be null: nothing is known and nothing kept.
  KnownLoops(const MergeConfig& config, const UserStatements& statements,
             LoopFingerprints& fingerprints, LoopOutcomes* outcomes);

  /// One constraint for each candidate, in their order. Candidates that people forbid, and those
  /// between sessions that they keep apart, are refused unseen.
  std::vector<LoopConstraint> verify(std::span<const LoopCandidate> candidates,
                                     const CorrectionLimit& limit, KeyframeClouds& clouds);

  /// Candidates that were verified, not known.
  [[nodiscard]] std::size_t verified() const { return verified_; }

  /// Why people refuse loops of two keyframes; null: they do not.
  [[nodiscard]] const char* refusal(KeyframeId query, KeyframeId match) const;

 private:
  /// Of candidates whose outcome is not known, and their questions.
  std::vector<LoopConstraint> verify(std::span<const LoopCandidate> unknown,
                                     std::span<const LoopQuestion> questions,
                                     const CorrectionLimit& limit, KeyframeClouds& clouds);

  const MergeConfig& config_;
  const UserStatements& statements_;
  LoopOutcomes* outcomes_;
  LoopFingerprints& fingerprints_;
  std::size_t verified_ = 0;
};

}  // namespace unimapper::merge
