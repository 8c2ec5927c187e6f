#include "cell_table.hpp"

namespace unimapper::onboard {

void CellTable::attach(Arena& arena, const VoxelConfig& config) noexcept {
  const std::uint32_t capacity = config.max_cells;
  blocks_.attach(arena, capacity);
  row_of_cell_ = arena.allocate<std::uint32_t>(capacity);
  x_ = arena.allocate<float>(capacity);
  y_ = arena.allocate<float>(capacity);
  z_ = arena.allocate<float>(capacity);
  index_ = arena.allocate<VoxelIndex>(capacity);
  points_ = arena.allocate<std::uint32_t>(capacity);
  scans_ = arena.allocate<std::uint32_t>(capacity);
  flags_ = arena.allocate<std::uint8_t>(capacity);
}

void CellTable::build(const ScanAccumulator& scans) noexcept {
  const FixedHashMap<CellSums>& cells = scans.cells();
  grid_ = scans.grid();
  blocks_.clear();
  left_out_ = 0;

  // Which block each cell belongs to; the row array serves as scratch for it.
  std::uint32_t* const block_of_cell = row_of_cell_;
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    const VoxelIndex index = unpack(cells.key(cell));
    const std::uint32_t block = blocks_.find_or_insert(pack(block_of(index)));
    block_of_cell[cell] = block;
    if (block == FixedHashMap<Block>::kNotFound) {
      ++left_out_;
      continue;
    }
    blocks_[block].occupied |= std::uint64_t{1} << bit_of(index);
  }

  size_ = 0;
  for (Block& block : blocks_.values()) {
    block.first = size_;
    size_ += count_bits(block.occupied);
  }

  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    if (block_of_cell[cell] == FixedHashMap<Block>::kNotFound) {
      row_of_cell_[cell] = kNoRow;
      continue;
    }
    const VoxelIndex index = unpack(cells.key(cell));
    const std::uint32_t row = row_of(blocks_[block_of_cell[cell]], bit_of(index));
    const CellSums& sums = cells[cell];
    const float inverse = 1.0F / static_cast<float>(sums.points);
    row_of_cell_[cell] = row;
    x_[row] = (static_cast<float>(index.x) + sums.x * inverse) * grid_.cell_size_m;
    y_[row] = (static_cast<float>(index.y) + sums.y * inverse) * grid_.cell_size_m;
    z_[row] = (static_cast<float>(index.z) + sums.z * inverse) * grid_.cell_size_m;
    index_[row] = index;
    points_[row] = sums.points;
    scans_[row] = sums.scans;
    flags_[row] = 0;
  }
}

}  // namespace unimapper::onboard
