// Layout constants of encoded keyframes, shared by writer and reader.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cell_key.hpp"

namespace unimapper::wire {

inline constexpr std::size_t kHeadBytes = 160;  ///< up to the scans
inline constexpr std::size_t kScanBytes = 108;
inline constexpr std::size_t kKeypointBytes = 26;
inline constexpr std::size_t kPlaneBytes = 10;
inline constexpr std::size_t kGroupBytes = 5;
inline constexpr std::size_t kCellBytes = 4;
inline constexpr std::size_t kUpBytes = 12;

inline constexpr std::uint16_t kFirstSchemaWithImages = 2;
inline constexpr std::uint16_t kFirstSchemaWithUp = 3;

/// A group's count shares its 16 bits with the ground flag; longer runs take several groups.
inline constexpr std::uint32_t kMaxGroupCells = 0x7FFF;
inline constexpr std::uint16_t kGroundFlag = 0x8000;

/// The part of a key that a group shares: block and ground flag.
constexpr std::uint64_t group_of(CellKey key) { return key >> 32U; }

}  // namespace unimapper::wire
