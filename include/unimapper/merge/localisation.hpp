// Localisation of a robot in a finished map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// Not yet: too little connects the robot to the map, or it was lost. Ambiguous: enough loops do,
/// and something else would explain them as well. Localised: the pose holds.
enum class LocalisationState : std::uint8_t { kNotYet, kAmbiguous, kLocalised };

/// "not yet", "ambiguous" or "localised".
[[nodiscard]] const char* state_name(LocalisationState state);

/// Where a keyframe lies in the map, by what was known when it was added.
struct MapPose {
  LocalisationState state = LocalisationState::kNotYet;  ///< poses hold only if localised
  std::string reason;   ///< why it is not localised, empty otherwise
  Pose T_map_keyframe;  ///< levelled keyframe frame to map frame, metres
  Pose T_map_odometry;  ///< odometry frame to map frame, so that this keyframe lies there
  /// Of `T_map_keyframe`: translation along the axes of the map, square metres, then the rotation
  /// vector in the keyframe's frame, square radians.
  Matrix6d covariance = Matrix6d::Identity();
  std::size_t loops = 0;         ///< that support the pose, since the robot was localised
  double path_m = 0.0;           ///< travelled since the first keyframe, by odometry
  double since_loop_m = 0.0;     ///< metres by odometry alone since the latest loop
  std::uint32_t times_lost = 0;  ///< how often a position was lost
};

/// Localises one robot in a map, keyframe by keyframe: search by descriptor, verification and the
/// acceptance rules between sessions (docs/localisation.md). Causal: an answer rests on the
/// keyframes added before, never on later ones. Deterministic. Memory is bounded: that of the map
/// and of the robot's latest keyframes. Not thread safe.
class Localiser {
 public:
  /// Of the robot, the latest ones; older ones go, half of them at once.
  static constexpr std::size_t kRememberedKeyframes = 400;

  /// `map`: sessions with the result of their merge, of which those in the map are used. Throws
  /// std::invalid_argument for a wrong configuration, and if the result is of other sessions or
  /// none of them is in the map.
  Localiser(std::vector<SessionData> sessions, const MergeResult& result,
            const MergeConfig& config = {});
  ~Localiser();
  Localiser(Localiser&&) noexcept;
  Localiser& operator=(Localiser&&) noexcept;

  /// Adds the robot's next keyframe, of one session. Throws std::invalid_argument for one that does
  /// not follow the one before or whose pose is no rigid transform. Cost: one search and some
  /// registrations; a hundred more when a first position is checked.
  MapPose add(KeyframeRecord keyframe);

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace unimapper::merge
