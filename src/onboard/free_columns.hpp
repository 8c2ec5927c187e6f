// The paper's free space: what lies between the ground and the lowest obstacle of a column.
#pragma once

#include <cstdint>

#include "cell_table.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_hash_map.hpp"

namespace unimapper::onboard {

/// Free space of one keyframe as the paper defines it (section IV-C): in every fine column of
/// C and G that holds ground, the empty cells above the highest ground cell and below the
/// lowest other cell; without any, everything above the ground.
class FreeColumns {
 public:
  void allocate(Arena& arena, std::size_t capacity) noexcept;

  /// From cells that `split_ground` has marked. O(cells).
  void build(const CellTable& cells) noexcept;
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

  [[nodiscard]] static VoxelKey key_of(const VoxelIndex& cell) noexcept;
  [[nodiscard]] static std::size_t column_of(const VoxelIndex& cell) noexcept;

  FixedHashMap<ColumnBlock> blocks_;
};

}  // namespace unimapper::onboard
