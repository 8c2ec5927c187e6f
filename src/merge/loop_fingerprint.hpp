// Fingerprint of all that the verification of a loop depends on.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "loop_verifier.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Changed whenever `verify_loops` comes to other outcomes for the same input: what was kept
/// before is verified again.
inline constexpr std::uint64_t kLoopVerificationVersion = 2;

/// Fingerprints of loop questions between keyframes of `sessions`. Each keyframe is read once.
class LoopFingerprints {
 public:
  LoopFingerprints(const std::vector<SessionData>& sessions, const MergeConfig& config);

  /// Of two keyframes with those that join their clouds, and of the parameters that matter.
  [[nodiscard]] std::uint64_t of(KeyframeId query, KeyframeId match, const CorrectionLimit& limit);

 private:
  std::uint64_t of_cloud(KeyframeId k);
  std::uint64_t of_record(KeyframeId k);

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  std::uint64_t parameters_ = 0;
  std::vector<std::vector<std::optional<std::uint64_t>>> records_;
  std::vector<std::vector<std::optional<std::uint64_t>>> clouds_;
};

}  // namespace unimapper::merge
