// Outcomes of checks of sensor data that are kept from merge to merge: of loops, of placements.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {

/// What the outcome of a verification depends on: two keyframes, the proposed pose, and everything
/// else.
struct LoopQuestion {
  KeyframeId query;    ///< the keyframe that was searched for
  KeyframeId match;    ///< the keyframe that was found
  Pose T_match_query;  ///< as proposed, levelled keyframe frames
  /// Of both keyframes' content with that of the neighbours in their clouds, of the parameters that
  /// matter, and of how loops are verified.
  std::uint64_t fingerprint = 0;
};

/// How far registration may correct a candidate's pose.
struct CorrectionLimit {
  double translation_m = 0.0;  ///< metres
  double rotation_rad = 0.0;   ///< radians
};

/// Verifies the questions at some positions on this machine: one outcome for each, in the order of
/// the positions.
using VerifyHere =
    std::function<std::vector<LoopConstraint>(std::span<const std::size_t> positions)>;

/// What the evidence about a placement depends on: two sessions, and everything else.
struct PlacementQuestion {
  std::uint32_t query = 0;  ///< the session that is placed
  std::uint32_t match = 0;  ///< the session it is placed in
  /// Of the placement, of the content of all keyframes of both sessions, of the parameters that
  /// matter, and of how placements are checked.
  std::uint64_t fingerprint = 0;
};

/// Where outcomes are kept. Called from one thread at a time.
class LoopOutcomes {
 public:
  /// A question with its outcome.
  struct Entry {
    LoopQuestion question;   ///< what was asked
    LoopConstraint outcome;  ///< what came of it
  };

  LoopOutcomes() = default;
  virtual ~LoopOutcomes() = default;
  LoopOutcomes(const LoopOutcomes&) = delete;
  LoopOutcomes& operator=(const LoopOutcomes&) = delete;

  /// The outcome of exactly this question, to the bit; nothing if it was never asked.
  virtual std::optional<LoopConstraint> find(const LoopQuestion& question) = 0;
  /// Outcomes of questions that `find` did not know, one for each, in their order. They are the
  /// same to the bit wherever they come from; by default all are verified here. `limit` is in their
  /// fingerprints.
  virtual std::vector<LoopConstraint> verify(std::span<const LoopQuestion> questions,
                                             const CorrectionLimit& limit,
                                             const VerifyHere& verify_here);
  /// Takes what `find` did not know. It may throw, which ends the merge.
  virtual void keep(std::span<const Entry> entries) = 0;

  /// The evidence for exactly this question; nothing if it was never asked.
  virtual std::optional<PlacementEvidence> find(const PlacementQuestion& question) = 0;
  /// As for loops.
  virtual void keep(const PlacementQuestion& question, const PlacementEvidence& evidence) = 0;
};

}  // namespace unimapper::merge
