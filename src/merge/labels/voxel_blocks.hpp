// Blocks of a keyframe's voxels and the sums around each voxel
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "src/free_space/block.hpp"
#include "src/free_space/components.hpp"
#include "src/merge/voxel_table.hpp"

namespace unimapper::merge {

/// Occupied voxels as blocks, numbered by rows (`row_of`) like the cells of the robot.
class VoxelBlocks {
 public:
  static constexpr std::uint32_t kNone = VoxelTable::kNone;  ///< no such block
  /// A block and its 26 neighbours.
  static constexpr std::size_t kAround = 27;

  /// O(voxels).
  explicit VoxelBlocks(const std::vector<VoxelKey>& voxels);

  [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }
  [[nodiscard]] std::uint32_t rows() const { return rows_; }
  /// Row of a voxel by its number in the list.
  [[nodiscard]] std::uint32_t row_of_voxel(std::size_t number) const {
    const Place& place = places_[number];
    return row_of(blocks_[place.block], place.bit);
  }
  /// Number of the block at an offset from block `b`, which may be (0, 0, 0), or `kNone`.
  [[nodiscard]] std::uint32_t neighbour(std::uint32_t b, const BlockOffset& offset) const {
    return neighbours_[b][at_offset(offset)];
  }
  /// Numbers of the blocks at all offsets from block `b`, x fastest, from -1 to 1; `kNone` without
  /// one.
  [[nodiscard]] const std::array<std::uint32_t, kAround>& around(std::uint32_t b) const {
    return neighbours_[b];
  }

 private:
  struct Place {
    std::uint32_t block;
    std::uint32_t bit;
  };
  [[nodiscard]] static std::size_t at_offset(const BlockOffset& offset) {
    return static_cast<std::size_t>((offset.x + 1) + 3 * (offset.y + 1) + 9 * (offset.z + 1));
  }
  void find_neighbours();

  VoxelTable table_;
  std::vector<Block> blocks_;
  std::vector<Place> places_;
  std::vector<std::array<std::uint32_t, kAround>> neighbours_;
  std::uint32_t rows_ = 0;
};
static_assert(VoxelBlocks::kNone == ComponentLabels::kNone);

/// What is summed up around a voxel.
struct SurroundingSum {
  std::int64_t log_odds = 0;  ///< thousandths
  std::uint32_t cells = 0;
};

/// Sums over the 5 x 5 x 5 voxels around each voxel. A block and half of its neighbours are laid
/// out as a cube of 8 x 8 x 8, which is summed up one axis after the other.
class SurroundingSums {
 public:
  /// `value[row]` is what a voxel adds. `left_out[b]` are the voxels of block b that neither add
  /// anything nor have a sum; null: none.
  SurroundingSums(const VoxelBlocks& blocks, const std::vector<SurroundingSum>& value,
                  const std::vector<std::uint64_t>* left_out)
      : blocks_(blocks), value_(value), left_out_(left_out) {}

  /// Calls `use(row, sum)` for every voxel of block `b` that is not left out. O(voxels near by).
  template <typename Use>
  void visit(std::uint32_t b, const Use& use) {
    const Block& block = blocks_.blocks()[b];
    const std::uint64_t wanted = block.occupied & ~left_out(b);
    if (wanted == 0) return;
    lay_out(b);
    sum_along_z();
    sum_along_y();
    visit_rows(block, wanted, [&](std::uint64_t cell, std::uint32_t row) {
      use(row, sum_along_x(static_cast<std::uint32_t>(std::countr_zero(cell))));
    });
  }
  /// Whether a voxel that is left out lies in reach of any of block `b`. O(1).
  [[nodiscard]] bool leaves_out_near(std::uint32_t b) const;

 private:
  static constexpr std::size_t kSide = 8;  ///< of the cube: a block's 4, and 2 on either side
  static constexpr std::size_t kPlane = kSide * kSide;

  [[nodiscard]] std::uint64_t left_out(std::uint32_t b) const {
    return left_out_ == nullptr ? 0 : (*left_out_)[b];
  }
  void lay_out(std::uint32_t b);
  void sum_along_z();
  void sum_along_y();
  [[nodiscard]] SurroundingSum sum_along_x(std::uint32_t bit) const;

  const VoxelBlocks& blocks_;
  const std::vector<SurroundingSum>& value_;
  const std::vector<std::uint64_t>* left_out_;
  /// The cube, then its sums along z, then along y too; x is fastest.
  std::array<std::int64_t, kPlane * kSide> log_odds_{};
  std::array<std::uint32_t, kPlane * kSide> cells_{};
};

}  // namespace unimapper::merge
