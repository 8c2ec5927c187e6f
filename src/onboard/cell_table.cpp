#include "cell_table.hpp"

namespace unimapper::onboard {

void CellTable::attach(Arena& arena, const VoxelConfig& config) noexcept {
  const std::uint32_t capacity = config.max_cells;
  blocks_ = arena.allocate<Block>(config.max_blocks());
  row_of_cell_ = arena.allocate<std::uint32_t>(capacity);
  x_ = arena.allocate<float>(capacity);
  y_ = arena.allocate<float>(capacity);
  z_ = arena.allocate<float>(capacity);
  where_ = arena.allocate<std::uint32_t>(capacity);
  points_ = arena.allocate<std::uint32_t>(capacity);
  flags_ = arena.allocate<std::uint8_t>(capacity);
}

void CellTable::build(const ScanAccumulator& scans, BlockWindow& window) noexcept {
  const FixedHashMap<CellSums>& cells = scans.cells();
  grid_ = scans.grid();
  block_count_ = 0;
  left_out_ = 0;

  // Which block each cell belongs to; the row array serves as scratch for it. Cells that were
  // met one after the other mostly share their block.
  std::uint32_t* const block_of_cell = row_of_cell_;
  VoxelIndex last{INT32_MAX, 0, 0};
  std::uint32_t number = BlockWindow::kNone;
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    const VoxelIndex index = unpack(cells.key(cell));
    const VoxelIndex block = block_of(index);
    if (!(block == last)) {
      last = block;
      number = window.enter(block);
      if (number == block_count_) blocks_[block_count_++] = {0, block, 0};
    }
    block_of_cell[cell] = number;
    if (number == BlockWindow::kNone) {
      ++left_out_;
      continue;
    }
    blocks_[number].occupied |= std::uint64_t{1} << bit_of(index);
  }

  size_ = 0;
  for (std::uint32_t b = 0; b < block_count_; ++b) {
    blocks_[b].first = size_;
    size_ += count_bits(blocks_[b].occupied);
  }

  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    const std::uint32_t b = block_of_cell[cell];
    if (b == BlockWindow::kNone) {
      row_of_cell_[cell] = kNoRow;
      continue;
    }
    const VoxelIndex index = unpack(cells.key(cell));
    const std::uint32_t bit = bit_of(index);
    const std::uint32_t row = row_of(blocks_[b], bit);
    const CellSums& sums = cells[cell];
    const Eigen::Vector3f mean = mean_of(index, sums, grid_.cell_size_m);
    row_of_cell_[cell] = row;
    x_[row] = mean.x();
    y_[row] = mean.y();
    z_[row] = mean.z();
    where_[row] = (b << 6U) | bit;
    points_[row] = sums.points;
    flags_[row] = 0;
  }
}

}  // namespace unimapper::onboard
