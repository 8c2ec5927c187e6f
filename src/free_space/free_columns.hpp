// Free space by columns
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

#include "block.hpp"
#include "src/core/fixed_hash_map.hpp"
#include "unimapper/core/arena.hpp"

namespace unimapper {

/// Free space of one keyframe as the paper defines it (section IV-C): in every fine column of
/// C and G that holds ground, the empty cells above the highest ground cell and below the
/// lowest other cell; without any, everything above the ground.
class FreeColumns {
 public:
  /// Takes room for `capacity` blocks out of the arena.
  void allocate(Arena& arena, std::size_t capacity) noexcept;

  /// From the occupied cells of blocks; `ground_of(b)` are those of block `b` that are ground, one
  /// bit each. O(cells).
  template <typename GroundOf>
  void build(std::span<const Block> blocks, const GroundOf& ground_of) noexcept {
    blocks_.clear();
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      visit(blocks[b], ground_of(b), [this](const VoxelIndex& cell) { add_ground(cell); });
    }
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      visit(blocks[b], blocks[b].occupied & ~ground_of(b),
            [this](const VoxelIndex& cell) { add_obstacle(cell); });
    }
  }
  /// Forgets all columns.
  void clear() noexcept { blocks_.clear(); }

  /// True if `cell` was seen as free; false if it was occupied or nothing is known.
  [[nodiscard]] bool is_free(const VoxelIndex& cell) const noexcept;

  /// Ground cells whose column found no room since the last `clear`.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return blocks_.refused(); }

 private:
  static constexpr std::int32_t kNoGround = INT32_MIN;
  static constexpr std::int32_t kNoObstacle = INT32_MAX;
  static constexpr std::int32_t kColumns = Block::kEdge * Block::kEdge;

  /// Heights of 4 x 4 columns, in cells.
  struct ColumnBlock {
    std::int32_t ground[kColumns];
    std::int32_t obstacle[kColumns];
    bool initialised;
  };

  template <typename Visit>
  static void visit(const Block& block, std::uint64_t cells, const Visit& visit) noexcept {
    for (; cells != 0; cells &= cells - 1) {
      visit(cell_in(block.index, static_cast<std::uint32_t>(std::countr_zero(cells))));
    }
  }
  void add_ground(const VoxelIndex& cell) noexcept;
  void add_obstacle(const VoxelIndex& cell) noexcept;
  [[nodiscard]] static VoxelKey key_of(const VoxelIndex& cell) noexcept;
  [[nodiscard]] static std::size_t column_of(const VoxelIndex& cell) noexcept;

  FixedHashMap<ColumnBlock> blocks_;
};

}  // namespace unimapper
