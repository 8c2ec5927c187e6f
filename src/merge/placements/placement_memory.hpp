// Evidence about placements, from merge to merge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "known_placements.hpp"

namespace unimapper::merge {

/// Bounds the checks of placements in one merge. Evidence about two sessions holds while their
/// placement stays where it was checked, and is renewed as they grow: by a quarter, or sooner where
/// it was not in favour. A placement that was never checked and finds no room waits: it is
/// provisional, as one with evidence against it.
class PlacementMemory {
 public:
  /// Both must outlive it.
  PlacementMemory(const std::vector<SessionData>& sessions, const MergeConfig& config)
      : sessions_(sessions), config_(config) {}

  /// A merge begins, with so many checks at most. `is_idle`: nothing is new, all may be renewed.
  void begin(std::uint32_t checks, bool is_idle);
  /// Whether this merge renews what is known of two sessions.
  [[nodiscard]] bool is_renewing() const { return renewed_.has_value(); }
  /// As `PlacementCheck`.
  [[nodiscard]] PlacementEvidence evaluate(const Placement& placement, KnownPlacements& placements);
  /// Takes what was found elsewhere.
  void learn(const Placement& placement, const PlacementEvidence& evidence);
  /// Whether a further merge would check more.
  [[nodiscard]] bool has_more() const;

 private:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;  // session of the query, of the match
  struct Known {
    Pose T_match_query;           ///< odometry frame to odometry frame
    std::vector<Pose> competing;  ///< placements, in the same frames
    PlacementEvidence evidence;
    std::size_t keyframes = 0;  ///< of both sessions
    std::uint64_t merge = 0;    ///< number of the merge that asked
  };
  [[nodiscard]] bool is_due(const Pair& pair, const Known& known, bool is_idle) const;
  [[nodiscard]] bool is_where(const Known& known, const Placement& placement) const;
  [[nodiscard]] std::size_t keyframes_of(const Pair& pair) const;

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  std::map<Pair, Known> known_;
  std::optional<Pair> renewed_;  ///< in this merge
  std::uint32_t checks_left_ = 0;
  std::uint64_t merge_ = 0;
  bool is_waiting_ = false;  ///< a placement found no room
};

}  // namespace unimapper::merge
