// Fingerprints of all that the verification of a loop, or the check of a placement, depends on.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "loop_verifier.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::merge {

/// Changed whenever `verify_loops` comes to other outcomes for the same input: what was kept
/// before is verified again.
inline constexpr std::uint64_t kLoopVerificationVersion = 5;

/// Changed whenever `PlacementEvaluator::evaluate` comes to other outcomes for the same input. Its
/// pairs of keyframes are verified like loops.
inline constexpr std::uint64_t kPlacementCheckVersion = 6;

/// Fingerprints of questions about keyframes and pairs of `sessions`. Keyframes are read as their
/// clouds need them.
class LoopFingerprints {
 public:
  LoopFingerprints(const std::vector<SessionData>& sessions, const MergeConfig& config);

  /// Keyframes of a session, from `record` on, are others than before, or are more; those whose
  /// clouds they join are from `cloud` on. The session may be new.
  void forget_from(std::size_t session, std::size_t record, std::size_t cloud);

  /// Of two keyframes with those that join their clouds, and of the parameters that matter.
  [[nodiscard]] std::uint64_t of(KeyframeId query, KeyframeId match, const CorrectionLimit& limit);

  /// Of a placement with all keyframes of both sessions, and of the parameters that matter.
  [[nodiscard]] std::uint64_t of(const Placement& placement);

 private:
  std::uint64_t of_cloud(KeyframeId k);
  std::uint64_t of_record(KeyframeId k);
  std::uint64_t of_session(std::size_t session);

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  std::uint64_t parameters_ = 0;
  std::uint64_t placement_parameters_ = 0;
  std::vector<std::vector<std::optional<std::uint64_t>>> records_;
  std::vector<std::vector<std::optional<std::uint64_t>>> clouds_;
};

}  // namespace unimapper::merge
