// Ways in which poses are misread, each of which one pose alone tells, and scales
#pragma once

#include <array>
#include <cstdint>

#include "unimapper/core/pose.hpp"

namespace unimapper {

/// Numbers are those of events and never change their meaning.
enum class KnownMistake : std::uint8_t {
  kNone = 0,
  kInverted = 1,    ///< T_sensor_world was given
  kWFirst = 2,      ///< quaternions were given as w, x, y, z
  kWLast = 3,       ///< as x, y, z, w where w is expected first
  kCameraAxes = 4,  ///< x right, y down, z forward
  kZDown = 5,       ///< x forward, y right, z down
  kLeftHanded = 6,  ///< mirrored along y
  kMirroredX = 7,
  kMirroredZ = 8,
  kYaw180 = 9,
  kYaw90 = 10,
  kYawMinus90 = 11,
  kTransposed = 12,  ///< rotations by columns
  // Positions in another unit.
  kMillimetres = 13,
  kCentimetres = 14,
  kKilometres = 15,
  kFeet = 16,
  kDecimetres = 17,
  kHundredsOfMetres = 18,
  kTensOfMetres = 19,
  kPointsInFeet = 20,  ///< positions in metres
};

inline constexpr std::uint8_t kFirstScale = 13;
inline constexpr std::uint8_t kKnownMistakes = 21;

/// Metres in the unit that positions look like; 1 for what is no scale.
[[nodiscard]] double metres_of(KnownMistake mistake) noexcept;

/// Axes of the poses in those of the points, for mistakes from `kCameraAxes` to `kYawMinus90`; else
/// the identity.
[[nodiscard]] Eigen::Matrix3d axes_of(KnownMistake mistake) noexcept;

/// The right pose for a given one, up to the frame of the world and its handedness.
[[nodiscard]] Pose correct(KnownMistake mistake, const Pose& pose) noexcept;

}  // namespace unimapper
