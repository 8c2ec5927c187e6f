// Loops of sessions that grow, from merge to merge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "growing_places.hpp"
#include "loop_fingerprint.hpp"
#include "loop_source.hpp"
#include "src/merge/placements/placement_memory.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "src/merge/sessions/plane_restorer.hpp"
#include "src/merge/sessions/session_growth.hpp"
#include "unimapper/merge/loop_outcomes.hpp"
#include "unimapper/merge/user_statements.hpp"
#include "verified_loops.hpp"

namespace unimapper::merge {

/// What one merge of growing sessions does at most, besides searching for new keyframes.
struct GrowthBudget {
  std::uint32_t by_descriptor = 12;  ///< candidates verified
  /// Candidates verified in a merge that renews the evidence of a placement.
  std::uint32_t beside_check = 4;
  std::uint32_t by_pose = 4;     ///< candidates verified of keyframes near each other in the map
  std::uint32_t placements = 1;  ///< checked by sensor data: as much work as 30 candidates
};

/// Searches for new keyframes only, keeps what was verified, and verifies in each merge so many
/// candidates as its budget allows: of each keyframe the best one with each session first, of these
/// those of the newest keyframes, of these the surest. The others wait. So do candidates of
/// keyframes whose clouds still grow.
class GrowingLoops {
 public:
  /// Both must outlive it. The sessions may grow and become more; a session's index stays.
  GrowingLoops(const std::vector<SessionData>& sessions, const MergeConfig& config);

  /// Notices what has changed; `searches`: and finds candidates of new keyframes.
  void take_growth(bool searches);
  /// Loops of the next merge under a budget; all must outlive the merge.
  [[nodiscard]] std::unique_ptr<LoopSource> within(const GrowthBudget& budget,
                                                   const UserStatements& statements,
                                                   LoopOutcomes* outcomes);
  /// All loops for the next merge, which are kept for later ones.
  [[nodiscard]] std::unique_ptr<LoopSource> all(const UserStatements& statements,
                                                LoopOutcomes* outcomes);
  /// Whether a further merge would verify or check more although nothing has grown.
  [[nodiscard]] bool has_more() const;

 private:
  class Learning;
  class UnderBudget;
  /// Of two keyframes; here and in `LoopCandidate` they are numbered by their sequence.
  using Pair = std::pair<KeyframeId, KeyframeId>;
  struct Found {
    LoopCandidate candidate;
    std::uint32_t rank = 0;   ///< among the candidates of its query with that session
    std::uint64_t merge = 0;  ///< that found it first
    std::optional<LoopConstraint> outcome;
  };
  struct Near {
    Pose T_match_query;  ///< as proposed
    LoopConstraint outcome;
  };

  void forget(const SessionChange& change);
  void search_within(std::size_t session, std::size_t keyframe);
  void search_between(std::size_t session, std::size_t keyframe);
  void find(const LoopCandidate& candidate, std::uint32_t rank);
  void learn(const LoopConstraint& verified);

  [[nodiscard]] std::vector<Pair> waiting() const;
  [[nodiscard]] bool has_whole_cloud(KeyframeId by_sequence) const;
  [[nodiscard]] std::optional<std::size_t> index_of(KeyframeId by_sequence) const;
  [[nodiscard]] KeyframeId by_sequence(KeyframeId k) const;
  template <typename Loop>
  [[nodiscard]] Loop at_index(const Loop& by_sequence) const;

  const std::vector<SessionData>& sessions_;
  const MergeConfig& config_;
  SessionGrowth growth_;
  KeyframeClouds clouds_;
  LoopFingerprints fingerprints_;
  PlaneRestorer planes_;
  GrowingPlaces places_;                   ///< of all sessions
  std::vector<GrowingPlaces> of_session_;  ///< of each session
  std::map<Pair, Found> found_;            ///< by descriptor, the lower keyframe first
  std::map<Pair, Near> near_;              ///< by poses
  PlacementMemory placements_;
  std::uint64_t merge_ = 0;
  bool has_grown_ = false;
};

}  // namespace unimapper::merge
