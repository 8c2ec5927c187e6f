// Layout constants of encoded keyframes, shared by writer and reader.
#pragma once

#include <cstddef>
#include <cstdint>

namespace unimapper::wire {

inline constexpr std::size_t kHeadBytes = 168;  ///< up to the counts, with them
inline constexpr std::size_t kScanBytes = 108;
inline constexpr std::size_t kKeypointBytes = 26;
inline constexpr std::size_t kPlaneBytes = 10;
inline constexpr std::size_t kUpBytes = 12;
inline constexpr std::size_t kCellEdgeBytes = 2;
inline constexpr std::size_t kSlipBytes = 24;  ///< only with the flag

/// Flag: the scans contradict the odometry.
inline constexpr std::uint16_t kOdometryContradicted = 1;
/// Flag: the odometry slipped since the keyframe before; by how much follows the edge of a cell.
inline constexpr std::uint16_t kOdometrySlipped = 2;

/// Flag: the intensities of the static cells follow these.
inline constexpr std::uint16_t kHasIntensities = 4;
inline constexpr std::size_t kFlagsAt = 6;

/// Edges of cells that a keyframe may have, metres.
inline constexpr float kSmallestCellM = 0.01F;
inline constexpr float kLargestCellM = 10.0F;

/// Every cell takes two bits at least.
inline constexpr std::uint32_t kMostCellsPerByte = 4;

}  // namespace unimapper::wire
