// Place of a robot in the map of its base station, as the base tells it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "unimapper/core/pose.hpp"
#include "unimapper/core/session_id.hpp"

namespace unimapper::wire {

/// How far a base is with the place of a robot; as `merge::LocalisationState`.
enum class MapPoseState : std::int8_t { kNotYet = 0, kAmbiguous = 1, kLocalised = 2 };

inline constexpr std::size_t kMaxMapPoseReasonBytes = 200;

/// From the base: where a robot is in the base's map. Of the robot's own poses it makes such in
/// the map: T_map_sensor = T_map_odometry * T_odometry_sensor.
struct MapPoseMessage {
  SessionId session;           ///< whose place
  std::int64_t epoch = 1;      ///< of the store's map, from 1; the frame is that epoch's map frame
  std::uint32_t sequence = 0;  ///< of the newest keyframe that the answer rests on
  std::int64_t stamp_ns = 0;   ///< of the reference scan of keyframe `sequence`
  MapPoseState state = MapPoseState::kNotYet;  ///< the pose holds only if localised
  Pose T_map_odometry;                         ///< odometry frame to map frame, metres
  /// Of T_map_keyframe = T_map_odometry * T_odometry_keyframe of keyframe `sequence`. Upper
  /// triangle, row by row: translation along the axes of the map (square metres), then the rotation
  /// vector in the keyframe's frame (square radians).
  std::array<double, 21> covariance{};
  std::uint32_t loops = 0;    ///< that support the pose
  double since_loop_m = 0.0;  ///< metres by odometry alone since the latest of them
  std::string reason;  ///< why it is not localised, empty otherwise; printable ASCII, at most
                       ///< `kMaxMapPoseReasonBytes`
};

/// Standard deviation of the keyframe's position along the map's three axes together, metres.
[[nodiscard]] inline double position_sigma_m(const MapPoseMessage& at) {
  constexpr std::size_t kX = 0;
  constexpr std::size_t kY = 6;
  constexpr std::size_t kZ = 11;
  return std::sqrt(at.covariance[kX] + at.covariance[kY] + at.covariance[kZ]);
}

}  // namespace unimapper::wire
