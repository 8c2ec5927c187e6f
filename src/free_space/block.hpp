// Blocks of 4 x 4 x 4 cells
#pragma once

#include <bit>
#include <cstdint>

#include "src/core/popcount.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper {

/// 4 x 4 x 4 cells, one bit each. Everything that asks "is that cell occupied?" asks 64 cells at
/// the cost of one look-up.
struct Block {
  static constexpr std::int32_t kEdgeBits = 2;           ///< log2 of the edge
  static constexpr std::int32_t kEdge = 1 << kEdgeBits;  ///< cells along each axis
  static constexpr std::uint32_t kCells = 64;            ///< cells of a block

  std::uint64_t occupied;  ///< one bit per cell
  VoxelIndex index;        ///< in units of blocks
  std::uint32_t first;     ///< row of the block's first cell; the others follow by bit number
};

/// From a block to one that touches it: -1, 0 or 1 along each axis.
struct BlockOffset {
  std::int32_t x;  ///< blocks along x
  std::int32_t y;  ///< blocks along y
  std::int32_t z;  ///< blocks along z
};

/// The block a cell lies in, in units of blocks.
[[nodiscard]] constexpr VoxelIndex block_of(const VoxelIndex& cell) noexcept {
  return {cell.x >> Block::kEdgeBits, cell.y >> Block::kEdgeBits, cell.z >> Block::kEdgeBits};
}

/// A cell's bit number within its block.
[[nodiscard]] constexpr std::uint32_t bit_of(const VoxelIndex& cell) noexcept {
  constexpr std::int32_t kMask = Block::kEdge - 1;
  return static_cast<std::uint32_t>((cell.x & kMask) | ((cell.y & kMask) << Block::kEdgeBits) |
                                    ((cell.z & kMask) << (2 * Block::kEdgeBits)));
}

/// The cell with number `bit` of a block.
[[nodiscard]] constexpr VoxelIndex cell_in(const VoxelIndex& block, std::uint32_t bit) noexcept {
  const auto b = static_cast<std::int32_t>(bit);
  return {(block.x << Block::kEdgeBits) + (b & 3), (block.y << Block::kEdgeBits) + (b >> 2 & 3),
          (block.z << Block::kEdgeBits) + (b >> 4)};
}

/// The lowest set bit of a word, or 0.
[[nodiscard]] constexpr std::uint64_t lowest_bit(std::uint64_t word) noexcept {
  return word & (~word + 1);
}

/// Row of the cell with number `bit` of a block that has it.
[[nodiscard]] inline std::uint32_t row_of(const Block& block, std::uint32_t bit) noexcept {
  return block.first + popcount(block.occupied & ((std::uint64_t{1} << bit) - 1U));
}

/// Calls `visit(cell, row)` for some of the cells that a block has, lowest bit first; `cell` is the
/// cell's bit. Counting along costs less than `row_of` for each.
template <typename Visit>
void visit_rows(const Block& block, std::uint64_t some, const Visit& visit) noexcept {
  if (some == 0) return;
  const std::uint64_t before = lowest_bit(some) - 1U;
  const std::uint64_t until = ~std::uint64_t{0} >> std::countl_zero(some);
  // Most often it is all that the block has.
  std::uint32_t row = block.first;
  if ((block.occupied & before) != 0) row += popcount(block.occupied & before);
  for (std::uint64_t left = block.occupied & until & ~before; left != 0; ++row, left &= left - 1) {
    const std::uint64_t cell = lowest_bit(left);
    if ((some & cell) != 0) visit(cell, row);
  }
}

}  // namespace unimapper
