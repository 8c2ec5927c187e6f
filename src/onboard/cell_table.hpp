// The occupied cells of a finished keyframe, in an order that makes neighbours neighbours.
#pragma once

#include <cstdint>
#include <span>

#include "block_window.hpp"
#include "grid.hpp"
#include "scan_accumulator.hpp"
#include "unimapper/core/arena.hpp"

namespace unimapper::onboard {

/// 4 x 4 x 4 cells, one bit each. Everything that asks "is that cell occupied?" asks 64 cells at
/// the price of one look-up.
struct Block {
  static constexpr std::int32_t kEdgeBits = 2;
  static constexpr std::int32_t kEdge = 1 << kEdgeBits;

  std::uint64_t occupied;
  VoxelIndex index;     ///< in units of blocks
  std::uint32_t first;  ///< row of the block's first cell; the others follow by bit number
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

/// Set bits of a word; without the instruction set's own, which firmware may lack.
[[nodiscard]] constexpr std::uint32_t count_bits(std::uint64_t word) noexcept {
  word -= (word >> 1U) & 0x5555555555555555ULL;
  word = (word & 0x3333333333333333ULL) + ((word >> 2U) & 0x3333333333333333ULL);
  word = (word + (word >> 4U)) & 0x0F0F0F0F0F0F0F0FULL;
  return static_cast<std::uint32_t>((word * 0x0101010101010101ULL) >> 56U);
}

/// Row of the cell with number `bit` of a block that has it.
[[nodiscard]] inline std::uint32_t row_of(const Block& block, std::uint32_t bit) noexcept {
  return block.first + count_bits(block.occupied & ((std::uint64_t{1} << bit) - 1U));
}

/// What is decided about a cell.
enum CellFlag : std::uint8_t {
  kCellGround = 1,     ///< belongs to the ground
  kCellCandidate = 2,  ///< not ground, and free space may show it to be dynamic
  kCellDynamic = 4,
  /// Dynamic in its own right, by evidence or by having been so, not for its neighbours' sake.
  kCellProven = 16,
  kCellLow = 32,  ///< a candidate so low above the ground that it connects nothing
  kCellFirm = 8,  ///< so often seen occupied that its neighbours cannot make it dynamic
};

/// Structure of arrays, one row per occupied cell, block after block. Blocks come in the order
/// in which the scans first touched them, so the table follows from the input alone.
class CellTable {
 public:
  void attach(Arena& arena, const VoxelConfig& config) noexcept;

  /// Sorts the cells of a keyframe into blocks, which it enters into the window. Cells whose block
  /// finds no room there are left out and counted. O(cells).
  void build(const ScanAccumulator& scans, BlockWindow& window) noexcept;

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// Cells left out by the last `build`.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }
  [[nodiscard]] const Grid& grid() const noexcept { return grid_; }
  /// By their number in the window's current keyframe.
  [[nodiscard]] std::span<const Block> blocks() const noexcept { return {blocks_, block_count_}; }

  /// Row of a cell of the accumulator, or `kNoRow`.
  static constexpr std::uint32_t kNoRow = 0xFFFFFFFFU;
  [[nodiscard]] std::uint32_t row_of_cell(std::uint32_t cell) const noexcept {
    return row_of_cell_[cell];
  }

  /// Mean of the points, metres from the grid's origin.
  [[nodiscard]] Eigen::Vector3f position(std::uint32_t row) const noexcept {
    return {x_[row], y_[row], z_[row]};
  }
  [[nodiscard]] const float* x() const noexcept { return x_; }
  [[nodiscard]] const float* y() const noexcept { return y_; }
  [[nodiscard]] const float* z() const noexcept { return z_; }
  [[nodiscard]] VoxelIndex index(std::uint32_t row) const noexcept {
    return cell_in(blocks_[where_[row] >> 6U].index, where_[row] & 63U);
  }
  [[nodiscard]] std::uint32_t points(std::uint32_t row) const noexcept { return points_[row]; }
  [[nodiscard]] std::uint8_t flags(std::uint32_t row) const noexcept { return flags_[row]; }
  void set_flag(std::uint32_t row, CellFlag flag) noexcept { flags_[row] |= flag; }
  void clear_flag(std::uint32_t row, CellFlag flag) noexcept {
    flags_[row] = static_cast<std::uint8_t>(flags_[row] & ~flag);
  }

 private:
  std::uint32_t size_ = 0;
  std::uint64_t left_out_ = 0;
  Grid grid_;
  Block* blocks_ = nullptr;
  std::uint32_t block_count_ = 0;
  std::uint32_t* row_of_cell_ = nullptr;
  float* x_ = nullptr;
  float* y_ = nullptr;
  float* z_ = nullptr;
  std::uint32_t* where_ = nullptr;  ///< block in the upper 26 bits, bit number in the lower 6
  std::uint32_t* points_ = nullptr;
  std::uint8_t* flags_ = nullptr;
};

}  // namespace unimapper::onboard
