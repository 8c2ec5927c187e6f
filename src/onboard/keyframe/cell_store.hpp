// Point sums by fine cell of the current keyframe
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "src/core/prefetch.hpp"
#include "src/free_space/block.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// The points of one fine cell. Sums are in cell edges from the cell's lower corner, which keeps
/// them exact to a fraction of a millimetre for any number of points.
struct CellSums {
  float x;
  float y;
  float z;
  std::uint32_t points;
};

/// Mean of a cell's points, metres from the grid's origin.
[[nodiscard]] inline Eigen::Vector3f mean_of(const VoxelIndex& cell, const CellSums& sums,
                                             float cell_size_m) noexcept {
  const float inverse = 1.0F / static_cast<float>(sums.points);
  return {(static_cast<float>(cell.x) + sums.x * inverse) * cell_size_m,
          (static_cast<float>(cell.y) + sums.y * inverse) * cell_size_m,
          (static_cast<float>(cell.z) + sums.z * inverse) * cell_size_m};
}

/// Fine cells by block. The cells of a block lie in groups of four, in the order of their
/// first points: a block that holds seven cells takes two cache lines, and where they are is one
/// line more. Blocks of more than sixteen cells have a second such line.
class CellStore {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  void allocate(Arena& arena, const VoxelConfig& config) noexcept;

  /// Forgets all cells and blocks. O(1).
  void clear() noexcept { block_count_ = size_ = groups_ = large_count_ = 0; }

  /// Appends a block without cells. There must be less than `VoxelConfig::max_blocks()`.
  void add_block(const VoxelIndex& index) noexcept;

  /// Entry of cell `bit` of a block, made if it was not there; `kNone` if there is no room for it.
  std::uint32_t find_or_insert(std::uint32_t block, std::uint32_t bit) noexcept {
    return (occupied_[block] >> bit & 1U) != 0 ? entry(block, bit) : insert(block, bit);
  }
  /// Entry of cell `bit` of a block that has it.
  [[nodiscard]] std::uint32_t entry(std::uint32_t block, std::uint32_t bit) const noexcept {
    const BlockCells& cells = blocks_[block];
    std::uint32_t rank = cells.low_rank[bit / 2] >> (bit % 2 * 4U) & 15U;
    if (cells.large != kNone) {
      rank |= (large_[cells.large].high_rank[bit / 4] >> (bit % 4 * 2U) & 3U) << 4U;
    }
    return entry_at(cells, rank);
  }

  /// Start loading what the next look-up in a block, or of a cell's sums, will read.
  void prefetch_block(std::uint32_t block) const noexcept {
    prefetch_for_read(occupied_ + block);
    prefetch_for_read(blocks_ + block);
  }
  void prefetch_sums(std::uint32_t entry) const noexcept { prefetch_for_write(sums_ + entry); }

  /// Starts loading all sums of a block.
  void prefetch_sums_of(std::uint32_t block) const noexcept {
    const std::uint32_t cells = popcount(occupied_[block]);
    for (std::uint32_t rank = 0; rank < cells; rank += kGroup) {
      prefetch_for_read(sums_ + entry_at(blocks_[block], rank));
    }
  }

  CellSums& operator[](std::uint32_t entry) noexcept { return sums_[entry]; }
  const CellSums& operator[](std::uint32_t entry) const noexcept { return sums_[entry]; }

  /// Blocks, numbered in the order in which they were added.
  [[nodiscard]] std::uint32_t block_count() const noexcept { return block_count_; }
  /// In units of blocks.
  [[nodiscard]] const VoxelIndex& index(std::uint32_t block) const noexcept {
    return blocks_[block].index;
  }
  /// Cells of every block, one bit each.
  [[nodiscard]] std::span<const std::uint64_t> occupied() const noexcept {
    return {occupied_, block_count_};
  }
  /// Cells held.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// Entries of the cells held are less than this.
  [[nodiscard]] std::uint32_t entries() const noexcept { return groups_ * kGroup; }
  /// Entries are never this or more.
  [[nodiscard]] static std::size_t max_entries(const VoxelConfig& config) noexcept {
    // A block leaves some slots of its last group empty: 0.3 for each cell with an OS2-128. With
    // sensors whose cells lie farther apart it is 0.6, but their cells are half as many as there is
    // room for.
    return (std::size_t{config.max_cells} + config.max_cells / 2 + kGroup - 1) / kGroup * kGroup;
  }

 private:
  static constexpr std::uint32_t kGroup = 4;
  static_assert(kGroup % 2 == 0, "no block shares a pair of entries: KeyframeOutput writes pairs");
  /// Cells of a block that needs no more than `BlockCells`.
  static constexpr std::uint32_t kFew = 16;

  /// Where the cells of a block lie: one cache line. The rank of a cell is how many of the block
  /// were inserted before it.
  struct alignas(64) BlockCells {
    std::uint8_t low_rank[Block::kCells / 2];  ///< lower four bits by bit number, two in a byte
    std::uint32_t group[kFew / kGroup];
    std::uint32_t large;  ///< entry in `large_`, or `kNone`
    VoxelIndex index;
  };
  /// What more than `kFew` cells need beyond that: another line.
  struct alignas(64) LargeBlock {
    std::uint8_t high_rank[Block::kCells / 4];  ///< upper two bits, four in a byte
    std::uint32_t group[(Block::kCells - kFew) / kGroup];
  };

  [[nodiscard]] std::uint32_t entry_at(const BlockCells& cells, std::uint32_t rank) const noexcept {
    const std::uint32_t group = rank < kFew ? cells.group[rank / kGroup]
                                            : large_[cells.large].group[(rank - kFew) / kGroup];
    return group * kGroup + rank % kGroup;
  }
  std::uint32_t insert(std::uint32_t block, std::uint32_t bit) noexcept;

  std::uint32_t capacity_ = 0;
  std::uint32_t max_groups_ = 0;
  std::uint32_t max_large_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t groups_ = 0;
  std::uint32_t block_count_ = 0;
  std::uint32_t large_count_ = 0;
  std::uint64_t* occupied_ = nullptr;  ///< by block
  BlockCells* blocks_ = nullptr;
  LargeBlock* large_ = nullptr;
  CellSums* sums_ = nullptr;
};

}  // namespace unimapper::onboard
