// Steps of an odometry that no robot makes
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Why loops of a session with such a step are refused.
inline constexpr const char* kImpossibleStep = "the odometry of a session steps as no robot moves";

/// From the last scan of a keyframe to the first one of the next.
struct OdometryStep {
  std::size_t keyframe = 0;  ///< index of the later one
  double length_m = 0.0;     ///< longer than the robot could have driven
  double duration_s = 0.0;   ///< by stamps
};

/// The first step that is longer than 3 m and half as much again as the robot drives meanwhile at
/// the fastest that it does within a keyframe, or at 3 m/s. Robots that go on in one session where
/// their odometry starts anew have such a step. Nothing where no keyframe tells a speed: keyframes
/// of one scan, scans that share a pose, or stamps that do not increase. O(scans).
[[nodiscard]] std::optional<OdometryStep> find_impossible_step(const SessionData& session);

/// What is wrong with a session that has this step, and what to do about it; empty without one.
[[nodiscard]] std::string reason_against_odometry(const SessionData& session);

}  // namespace unimapper::merge
