// Occupied cells of a keyframe in block order
#pragma once

#include <cstdint>
#include <span>

#include "cell_store.hpp"
#include "grid.hpp"
#include "src/free_space/block.hpp"
#include "src/onboard/slice.hpp"
#include "unimapper/core/arena.hpp"

namespace unimapper::onboard {

/// What is decided about the cells of a block, one bit per cell.
struct CellMarks {
  std::uint64_t ground = 0;     ///< belong to the ground
  std::uint64_t candidate = 0;  ///< not ground, and free space may show them to be dynamic
  /// Candidates that follow a component they touch, but connect none: so low above the ground, or a
  /// stray return.
  std::uint64_t follower = 0;
  std::uint64_t dynamic = 0;
  /// Dynamic in their own right, by evidence or by having been so, not for their neighbours' sake.
  std::uint64_t proven = 0;
  /// So often observed as occupied that their component cannot make them dynamic, unless they are
  /// followers: what stood on that spot before may have been grass or a kerb.
  std::uint64_t confirmed_static = 0;
  /// So often seen through that their component cannot make them static.
  std::uint64_t confirmed_dynamic = 0;
};
/// Names one of the marks, for code that asks about single cells.
using CellMark = std::uint64_t CellMarks::*;

/// Structure of arrays, one row per occupied cell, block after block. Blocks come in the order of
/// their numbers in the window, which follows from the input alone.
class CellTable {
 public:
  void allocate(Arena& arena, const VoxelConfig& config) noexcept;

  /// Begins the table of a keyframe. O(1).
  void begin(const Grid& grid) noexcept;
  /// Lays out the cells of some blocks of the store row by row, all of them in the given order.
  /// O(cells).
  void add(const CellStore& cells, std::span<const std::uint32_t> order, Slice some,
           const Executor& executor = {}) noexcept;

  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  [[nodiscard]] const Grid& grid() const noexcept { return grid_; }
  /// By their number in the window's current keyframe.
  [[nodiscard]] std::span<const Block> blocks() const noexcept { return {blocks_, block_count_}; }

  /// Entry of a row's cell in the store.
  [[nodiscard]] std::uint32_t entry(std::uint32_t row) const noexcept { return entry_[row]; }

  /// Mean of the points, metres from the grid's origin.
  [[nodiscard]] Eigen::Vector3f position(std::uint32_t row) const noexcept {
    return {x_[row], y_[row], z_[row]};
  }
  [[nodiscard]] const float* x() const noexcept { return x_; }
  [[nodiscard]] const float* y() const noexcept { return y_; }
  [[nodiscard]] const float* z() const noexcept { return z_; }
  [[nodiscard]] VoxelIndex index(std::uint32_t row) const noexcept {
    return cell_in(blocks_[block_of_row(row)].index, bit_of_row(row));
  }
  /// Number of a row's block, and of its cell within it.
  [[nodiscard]] std::uint32_t block_of_row(std::uint32_t row) const noexcept {
    return where_[row] >> 6U;
  }
  [[nodiscard]] std::uint32_t bit_of_row(std::uint32_t row) const noexcept {
    return where_[row] & 63U;
  }
  [[nodiscard]] std::uint32_t points(std::uint32_t row) const noexcept { return points_[row]; }

  /// Marks of a block's cells by the block's number.
  [[nodiscard]] CellMarks& marks(std::uint32_t block) noexcept { return marks_[block]; }
  [[nodiscard]] const CellMarks& marks(std::uint32_t block) const noexcept { return marks_[block]; }
  /// Whether the cell of a row has a mark.
  [[nodiscard]] bool has(std::uint32_t row, CellMark mark) const noexcept {
    return (marks_[block_of_row(row)].*mark >> bit_of_row(row) & 1U) != 0;
  }
  void set(std::uint32_t row, CellMark mark) noexcept {
    marks_[block_of_row(row)].*mark |= std::uint64_t{1} << bit_of_row(row);
  }

 private:
  /// Block `b`, whose first row is `row`. Returns the row behind its last one.
  std::uint32_t add_block(const CellStore& cells, std::uint32_t from, std::uint32_t b,
                          std::uint32_t row) noexcept;

  std::uint32_t size_ = 0;
  Grid grid_;
  Block* blocks_ = nullptr;
  CellMarks* marks_ = nullptr;  ///< by block
  std::uint32_t block_count_ = 0;
  std::uint32_t* entry_ = nullptr;
  float* x_ = nullptr;
  float* y_ = nullptr;
  float* z_ = nullptr;
  std::uint32_t* where_ = nullptr;  ///< block in the upper 26 bits, bit number in the lower 6
  std::uint32_t* points_ = nullptr;
};

}  // namespace unimapper::onboard
