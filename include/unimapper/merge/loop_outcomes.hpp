// Outcomes of checks of sensor data that are kept from merge to merge: of loops, of placements.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

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
  /// Takes what `find` did not know. It may throw, which ends the merge.
  virtual void keep(std::span<const Entry> entries) = 0;

  /// The evidence for exactly this question; nothing if it was never asked.
  virtual std::optional<PlacementEvidence> find(const PlacementQuestion& question) = 0;
  /// As for loops.
  virtual void keep(const PlacementQuestion& question, const PlacementEvidence& evidence) = 0;
};

}  // namespace unimapper::merge
