// Check of the placement of one session in another by sensor data.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "src/merge/loops/loop_search.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// Looks for what loops cannot say: whether the query fits the same map elsewhere as well
/// (perceptual aliasing: a period, a deck), whether the scans exclude what other loops propose, and
/// whether keyframes that lie beside each other in the placement see the same, with walls at the
/// same distance. Bounded: eight loops are moved to a dozen places each, and of each placement
/// sixteen pairs of keyframes are verified.
class PlacementEvaluator {
 public:
  PlacementEvaluator(const std::vector<SessionData>& sessions, KeyframeClouds& clouds,
                     const MergeConfig& config)
      : sessions_(sessions), clouds_(clouds), config_(config) {}

  /// As `PlacementCheck`.
  [[nodiscard]] PlacementEvidence evaluate(const Placement& placement);

  /// How well one loop's query fits elsewhere in the match session.
  struct Repetition {
    double best_share = 0.0;  ///< 1: as well as where the loop puts it; 0: nowhere
    /// Metres to the nearest place where it fits as well; infinite without one.
    double shift_m = std::numeric_limits<double>::infinity();
  };
  /// Of up to eight loops, evenly spread.
  [[nodiscard]] std::vector<Repetition> look_elsewhere(const Placement& placement);

  /// What two keyframes that lie beside each other in a placement say of it.
  enum class Vote : std::uint8_t {
    kNone,     ///< they see too little in common
    kAgrees,   ///< they see the same
    kDiffers,  ///< one saw through what the other sees
  };
  /// Of up to sixteen pairs, evenly spread.
  [[nodiscard]] std::vector<Vote> ask_neighbours(const Placement& placement);

 private:
  struct Elsewhere;
  [[nodiscard]] Vote vote_of(const LoopCandidate& pair, const LoopConstraint& verified) const;
  [[nodiscard]] bool is_registered(const LoopCandidate& pair, const LoopConstraint& verified) const;
  [[nodiscard]] std::string find_walls_apart(const Placement& placement) const;
  [[nodiscard]] std::string find_competing(const Placement& placement);
  [[nodiscard]] std::string find_repetition(const Placement& placement);
  [[nodiscard]] std::string find_storeys(const Placement& placement) const;
  /// Shares of the structure, medians.
  struct StandingShares {
    std::optional<double> between;  ///< stands in one of both sessions alone; empty: not known
    /// Stands in one of two keyframes of a session alone; empty: not known.
    std::optional<double> within;
  };
  [[nodiscard]] bool is_continued(const Placement& placement) const;
  [[nodiscard]] StandingShares standing_shares(const Placement& placement) const;
  [[nodiscard]] double share_elsewhere(const LoopConstraint& loop, const Elsewhere& place) const;
  [[nodiscard]] std::vector<Elsewhere> places_elsewhere(const Placement& placement,
                                                        const LoopConstraint& loop) const;
  /// `loops` and where they put the query: those of the placement, or of a competing one.
  [[nodiscard]] std::vector<LoopCandidate> beside_each_other(const Placement& placement,
                                                             std::span<const LoopConstraint> loops,
                                                             const Pose& T_match_query) const;
  /// By keyframe of the query beside the map, the share of the common view that was seen through.
  [[nodiscard]] std::map<std::size_t, double> seen_through(const Placement& placement,
                                                           std::span<const LoopConstraint> loops,
                                                           const Pose& T_match_query);

  const std::vector<SessionData>& sessions_;
  KeyframeClouds& clouds_;
  const MergeConfig& config_;
};

}  // namespace unimapper::merge
