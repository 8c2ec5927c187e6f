// First position of a robot in a map, by the loops gathered so far.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "src/merge/loops/loop_acceptance.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "unimapper/merge/localisation.hpp"

namespace unimapper::merge {

/// Gathers loops of a robot to the sessions of a map until they place it as surely as two sessions
/// must be placed to be merged.
class FirstPosition {
 public:
  /// `sessions`: those of the map, then the robot's; `map_paths`: of the map's, map frame. All must
  /// outlive it.
  FirstPosition(const std::vector<SessionData>& sessions, const std::vector<SessionPath>& map_paths,
                KeyframeClouds& clouds, const MergeConfig& config);

  /// What is known of the position.
  struct Outcome {
    LocalisationState state = LocalisationState::kNotYet;
    std::string reason;                 ///< why there is none, empty otherwise
    std::vector<LoopConstraint> loops;  ///< that place the robot, by keyframe
    AcceptanceConfig rules;             ///< by which they do
  };

  /// Adds verified loops, queries of the robot, and looks again. `path`: the robot's, odometry
  /// frame. Cost: a clique search per session; a hundred registrations where a set has grown.
  Outcome find(std::vector<LoopConstraint> loops, const SessionPath& path);

  /// Forgets all loops.
  void clear();
  /// The robot's first `count` keyframes are gone.
  void forget_first(std::size_t count);

 private:
  struct Asked {
    std::size_t distinct = 0;
    bool is_short = false;
  };

  [[nodiscard]] AcceptanceConfig rules(std::size_t session, double robot_extent_m) const;
  void keep_window(std::vector<LoopConstraint>& loops, const SessionPath& path) const;
  [[nodiscard]] std::string contradiction_by_others(const std::vector<ConsistencySet>& sets,
                                                    std::size_t session, const Pose& here) const;
  [[nodiscard]] std::string reason_by_data(std::size_t session, const ConsistencySet& set,
                                           const std::vector<LoopConstraint>& inliers,
                                           const SessionPath& path);

  const std::vector<SessionData>& sessions_;
  const std::vector<SessionPath>& map_paths_;
  KeyframeClouds& clouds_;
  const MergeConfig& config_;
  std::vector<double> extents_m_;                   // by session of the map
  std::vector<std::vector<LoopConstraint>> loops_;  // likewise
  std::vector<Asked> asked_;                        // likewise: the set that data refused
  std::vector<std::string> refused_;                // likewise: why they did
};

/// The first keyframes of a session are gone: loops of theirs go, the others' numbers follow.
void forget_first_queries(std::vector<LoopConstraint>& loops, std::size_t count);

}  // namespace unimapper::merge
