// Statements of people about sessions, loops and known positions: satellites, surveys, floors.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::merge {

/// Two keyframes that show the same surroundings, by a person's word.
struct KeyframeLink {
  KeyframeId query;                   ///< one keyframe of the link
  KeyframeId match;                   ///< the other keyframe of the link
  std::optional<Pose> T_match_query;  ///< between levelled keyframe frames, as far as known
};

/// A loop by its keyframes; which of them was searched for makes no difference.
struct KeyframePair {
  KeyframeId a;  ///< one keyframe of the loop
  KeyframeId b;  ///< the other keyframe of the loop
};

/// A position of a point that moves with a keyframe, in the site frame: Cartesian, z up, the same
/// for all positions of a merge.
struct KnownPosition {
  KeyframeId keyframe;       ///< the keyframe it belongs to
  Eigen::Vector3d position;  ///< site frame, metres; x and y count for nothing if only z is known
  /// The point, levelled keyframe frame, metres: zero is the sensor, else a lever arm.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  /// Standard deviation of x and of y, metres; infinite: only the height is known.
  double sigma_xy_m = std::numeric_limits<double>::infinity();
  double sigma_z_m = 1.0;  ///< standard deviation of z, metres

  /// Whether x and y are known.
  [[nodiscard]] bool is_horizontal() const { return std::isfinite(sigma_xy_m); }
};

/// What a merge made of a known position.
struct PositionOutcome {
  KnownPosition given;         ///< as it was given
  bool used = false;           ///< part of the pose graph
  std::string reason;          ///< why it was not used, empty otherwise
  Eigen::Vector3d residual_m;  ///< the map's position less the given one; of a used one
};

/// Where the map lies in the site frame: by `origin`, without rotation.
struct Georeference {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of the map frame in the site frame, metres
  bool is_horizontal = false;                        ///< x and y are known, not the height alone
  /// Standard deviation of the map's heading by the positions, radians; infinite: unknown, the
  /// heading is that of the central session's odometry.
  double heading_sigma_rad = std::numeric_limits<double>::infinity();
};

/// Statements that a merge obeys. Sessions by their index.
struct UserStatements {
  std::vector<KeyframeLink> links;           ///< loops, whatever the acceptance rules say
  std::vector<KeyframePair> forbidden;       ///< loops that are wrong
  std::vector<std::uint32_t> apart;          ///< sessions that stay apart from the map
  std::optional<std::uint32_t> reference{};  ///< the session whose frame is the map's
  std::vector<KnownPosition> positions{};    ///< of keyframes; at most one of each

  /// Whether a loop between these two is wrong, by a person's word.
  [[nodiscard]] bool forbid(KeyframeId query, KeyframeId match) const;
  /// Whether a session stays apart.
  [[nodiscard]] bool keep_apart(std::uint32_t session) const;
};

/// Reasons in the decisions on loops and sessions.
inline constexpr const char* kLinkedByPerson = "linked by a person";
inline constexpr const char* kForbiddenByPerson = "forbidden by a person";
inline constexpr const char* kApartByPerson = "kept apart by a person";

}  // namespace unimapper::merge
