// Body dimensions of a person, shared by prototypes and animation.
#pragma once

namespace unimapper::simulator::person {

inline constexpr double kHipHeight = 0.88;  ///< metres above the ground, scale 1
inline constexpr double kHipHalfWidth = 0.1;
inline constexpr double kShoulderHeight = 1.42;
inline constexpr double kShoulderHalfWidth = 0.22;
inline constexpr double kStride = 1.4;  ///< metres per full cycle of both legs
inline constexpr double kSwing = 0.42;  ///< radians either way

}  // namespace unimapper::simulator::person
