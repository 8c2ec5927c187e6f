#include "free_columns.hpp"

namespace unimapper {

VoxelKey FreeColumns::key_of(const VoxelIndex& cell) noexcept {
  const VoxelIndex block = block_of(cell);
  return pack({block.x, block.y, 0});
}

std::size_t FreeColumns::column_of(const VoxelIndex& cell) noexcept {
  return bit_of({cell.x, cell.y, 0});
}

void FreeColumns::allocate(Arena& arena, std::size_t capacity) noexcept {
  blocks_.allocate(arena, capacity);
}

void FreeColumns::add_ground(const VoxelIndex& cell) noexcept {
  const std::uint32_t entry = blocks_.find_or_insert(key_of(cell));
  if (entry == FixedHashMap<ColumnBlock>::kNotFound) return;
  ColumnBlock& block = blocks_[entry];
  if (!block.initialised) {
    block.initialised = true;
    std::fill_n(block.ground, kColumns, kNoGround);
    std::fill_n(block.obstacle, kColumns, kNoObstacle);
  }
  std::int32_t& ground = block.ground[column_of(cell)];
  ground = std::max(ground, cell.z);
}

void FreeColumns::add_obstacle(const VoxelIndex& cell) noexcept {
  const std::uint32_t entry = blocks_.find(key_of(cell));
  if (entry == FixedHashMap<ColumnBlock>::kNotFound) return;
  ColumnBlock& block = blocks_[entry];
  const std::size_t column = column_of(cell);
  if (cell.z <= block.ground[column]) return;
  block.obstacle[column] = std::min(block.obstacle[column], cell.z);
}

bool FreeColumns::is_free(const VoxelIndex& cell) const noexcept {
  const std::uint32_t entry = blocks_.find(key_of(cell));
  if (entry == FixedHashMap<ColumnBlock>::kNotFound) return false;
  const ColumnBlock& block = blocks_[entry];
  const std::size_t column = column_of(cell);
  return block.ground[column] != kNoGround && cell.z > block.ground[column] &&
         cell.z < block.obstacle[column];
}

}  // namespace unimapper
