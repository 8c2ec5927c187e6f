// Origin of the map frame in the site frame, or in an odometry frame far from its own.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <span>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merger.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// Points of a map are floats, which hold a millimetre up to some kilometres from the origin. So a
/// coordinate of 10 km or more is rounded to kilometres and is the origin's.
[[nodiscard]] inline double origin_of_coordinate(double value) {
  constexpr double kFarM = 10000.0;
  constexpr double kStepM = 1000.0;
  return std::abs(value) >= kFarM ? kStepM * std::round(value / kStepM) : 0.0;
}

/// Of a session's first scan, in its odometry frame; zero without keyframes.
[[nodiscard]] inline Eigen::Vector3d first_position(const SessionData& session) {
  if (session.keyframes.empty()) return Eigen::Vector3d::Zero();
  const KeyframeRecord& first = session.keyframes.front();
  return first.scans.empty() ? first.T_odometry_keyframe.translation
                             : first.scans.front().T_odometry_sensor.translation;
}

/// Of a session's odometry frame, which may count in a country's coordinates.
[[nodiscard]] inline Eigen::Vector3d odometry_origin(const SessionData& session) {
  return first_position(session).unaryExpr(&origin_of_coordinate);
}

/// What trajectories of a session count from in its frame, or the map's; coordinates of a
/// georeferenced map are those of its files.
[[nodiscard]] inline Eigen::Vector3d trajectory_origin(const std::vector<SessionData>& sessions,
                                                       const MergeResult& result,
                                                       std::size_t session) {
  if (!is_in_map(result.sessions[session].status)) return odometry_origin(sessions[session]);
  if (result.georeference) return Eigen::Vector3d::Zero();
  return odometry_origin(sessions[result.central_session]);
}

/// By the first position, which stays the first as others are added.
[[nodiscard]] inline Eigen::Vector3d site_origin(std::span<const KnownPosition> positions) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  bool has_horizontal = false;
  for (const KnownPosition& position : positions) {
    const auto round = [&](int axis) {
      origin[axis] = origin_of_coordinate(position.position[axis]);
    };
    if (&position == &positions.front()) round(2);
    if (has_horizontal || !position.is_horizontal()) continue;
    has_horizontal = true;
    round(0);
    round(1);
  }
  return origin;
}

}  // namespace unimapper::merge
