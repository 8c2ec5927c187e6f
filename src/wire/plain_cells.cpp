#include "plain_cells.hpp"

#include <cstdint>

#include "unimapper/core/quantise.hpp"

namespace unimapper::wire {

namespace {

constexpr std::size_t kGroupBytes = 5;
constexpr std::size_t kCellBytes = 4;

/// A group's count shares its 16 bits with the ground flag; longer runs take several groups.
constexpr std::uint32_t kMaxGroupCells = 0x7FFF;
constexpr std::uint16_t kGroundFlag = 0x8000;

/// From the top: block x y z (8 bits each), not-ground (1), x y z within the block in cm (8 each),
/// points (8).
using PlainKey = std::uint64_t;

/// The part of a key that a group's cells share, and how many cells follow.
struct GroupHeader {
  std::uint64_t group = 0;
  std::uint32_t cells = 0;
};

GroupHeader get_group(LittleEndianReader& in) {
  GroupHeader header;
  for (int axis = 0; axis < 3; ++axis) header.group = (header.group << 8U) | in.get<std::uint8_t>();
  const auto count = in.get<std::uint16_t>();
  header.group = (header.group << 1U) | ((count & kGroundFlag) != 0 ? 0U : 1U);
  header.cells = count & kMaxGroupCells;
  return header;
}

FineCell cell_of(PlainKey key) {
  Eigen::Vector3i steps;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto block = static_cast<std::int32_t>((key >> (49U - 8U * axis)) & 0xFFU);
    const auto offset = static_cast<std::int32_t>((key >> (24U - 8U * axis)) & 0xFFU);
    steps[axis] = (block << 8) + offset - 32768;
  }
  FineCell cell{};
  cell.position = from_centimetres(steps);
  cell.points = static_cast<std::uint16_t>(key & 0xFFU);
  cell.ground = ((key >> 32U) & 1U) == 0 ? 1 : 0;
  return cell;
}

}  // namespace

const char* read_plain_cells(LittleEndianReader& in, std::vector<FineCell>& cells) {
  const auto groups = in.get<std::uint32_t>();
  const auto count = in.get<std::uint32_t>();
  if (!in.ok() || groups > in.remaining() / kGroupBytes || count > in.remaining() / kCellBytes ||
      groups * kGroupBytes + count * kCellBytes > in.remaining()) {
    return "fewer bytes than cells";
  }
  cells.reserve(count);
  PlainKey last_key = 0;
  GroupHeader last;
  for (std::uint32_t g = 0; g < groups; ++g) {
    const GroupHeader header = get_group(in);
    if (header.cells == 0) return "an empty group of cells";
    if (header.cells > count - cells.size()) return "more cells than announced";
    if (g > 0 && header.group == last.group && last.cells != kMaxGroupCells) {
      return "a group of cells is split for no reason";
    }
    last = header;
    for (std::uint32_t i = 0; i < header.cells; ++i) {
      PlainKey key = header.group;
      for (int byte = 0; byte < 4; ++byte) key = (key << 8U) | in.get<std::uint8_t>();
      if (key < last_key) return "cells are not sorted";
      last_key = key;
      cells.push_back(cell_of(key));
    }
  }
  return cells.size() == count ? nullptr : "fewer cells than announced";
}

}  // namespace unimapper::wire
