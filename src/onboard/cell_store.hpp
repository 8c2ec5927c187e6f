// Point sums by fine cell of the current keyframe
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/prefetch.hpp"
#include "unimapper/free_space/block.hpp"
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
/// first points: a block that holds seven cells takes two cache lines, and finding a cell of a
/// known block is two array accesses.
class CellStore {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  void allocate(Arena& arena, const VoxelConfig& config) noexcept;

  /// Forgets all cells and blocks. O(1).
  void clear() noexcept { block_count_ = size_ = groups_ = 0; }

  /// Appends a block without cells. There must be less than `VoxelConfig::max_blocks()`.
  void add_block(const VoxelIndex& index) noexcept;

  /// Entry of cell `bit` of a block, made if it was not there; `kNone` if all cells are taken.
  std::uint32_t find_or_insert(std::uint32_t block, std::uint32_t bit) noexcept {
    const std::uint8_t rank = cells_[block].rank[bit];
    return rank != kNoRank ? entry_at(block, rank) : insert(block, bit);
  }
  /// Entry of cell `bit` of a block that has it.
  [[nodiscard]] std::uint32_t entry(std::uint32_t block, std::uint32_t bit) const noexcept {
    return entry_at(block, cells_[block].rank[bit]);
  }

  /// Start loading what the next look-up in a block, or of a cell's sums, will read.
  void prefetch_block(std::uint32_t block) const noexcept {
    prefetch_for_read(blocks_ + block);
    prefetch_for_read(cells_[block].rank);
    prefetch_for_read(cells_[block].group);
  }
  void prefetch_sums(std::uint32_t entry) const noexcept { prefetch_for_write(sums_ + entry); }

  /// The same for all sums of a block.
  void prefetch_sums_of(std::uint32_t block) const noexcept {
    const std::uint32_t cells = popcount(blocks_[block].occupied);
    for (std::uint32_t rank = 0; rank < cells; rank += kGroup) {
      prefetch_for_read(sums_ + entry_at(block, rank));
    }
  }

  CellSums& operator[](std::uint32_t entry) noexcept { return sums_[entry]; }
  const CellSums& operator[](std::uint32_t entry) const noexcept { return sums_[entry]; }

  /// In the order in which they were added; `first` means nothing yet.
  [[nodiscard]] std::span<const Block> blocks() const noexcept { return {blocks_, block_count_}; }
  /// Cells held.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// Entries are less than this.
  [[nodiscard]] static std::size_t max_entries(const VoxelConfig& config) noexcept {
    // Every block may leave three slots of its last group empty.
    const std::size_t blocks = config.max_blocks();
    return (std::size_t{config.max_cells} + blocks * (kGroup - 1) + kGroup - 1) / kGroup * kGroup;
  }

 private:
  static constexpr std::uint32_t kGroup = 4;
  static constexpr std::uint8_t kNoRank = 0xFF;

  /// Where the cells of a block lie.
  struct BlockCells {
    std::uint8_t rank[Block::kCells];  ///< by bit number: how many were inserted before it
    std::uint32_t group[Block::kCells / kGroup];
  };

  [[nodiscard]] std::uint32_t entry_at(std::uint32_t block, std::uint32_t rank) const noexcept {
    return cells_[block].group[rank / kGroup] * kGroup + rank % kGroup;
  }
  std::uint32_t insert(std::uint32_t block, std::uint32_t bit) noexcept;

  std::uint32_t capacity_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t groups_ = 0;
  std::uint32_t block_count_ = 0;
  Block* blocks_ = nullptr;
  BlockCells* cells_ = nullptr;  ///< by block
  CellSums* sums_ = nullptr;
};

}  // namespace unimapper::onboard
