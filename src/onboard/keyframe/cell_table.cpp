#include "cell_table.hpp"

#include <bit>

namespace unimapper::onboard {

void CellTable::allocate(Arena& arena, const VoxelConfig& config) noexcept {
  const std::uint32_t capacity = config.max_cells;
  blocks_ = arena.allocate<Block>(config.max_blocks());
  marks_ = arena.allocate<CellMarks>(config.max_blocks());
  entry_ = arena.allocate<std::uint32_t>(capacity);
  x_ = arena.allocate<float>(capacity);
  y_ = arena.allocate<float>(capacity);
  z_ = arena.allocate<float>(capacity);
  where_ = arena.allocate<std::uint32_t>(capacity);
  points_ = arena.allocate<std::uint32_t>(capacity);
}

void CellTable::begin(const Grid& grid) noexcept {
  grid_ = grid;
  block_count_ = 0;
  size_ = 0;
}

void CellTable::add(const CellStore& cells, std::span<const std::uint32_t> order,
                    Slice some) noexcept {
  constexpr std::size_t kAhead = 4;  // blocks whose sums are loaded in advance
  for (std::size_t i = some.first; i < some.end; ++i) {
    if (i + 2 * kAhead < order.size()) cells.prefetch_block(order[i + 2 * kAhead]);
    if (i + kAhead < order.size()) cells.prefetch_sums_of(order[i + kAhead]);
    add_block(cells, order[i]);
  }
}

void CellTable::add_block(const CellStore& cells, std::uint32_t from) noexcept {
  const std::uint32_t b = block_count_++;
  const Block block{cells.occupied()[from], cells.index(from), size_};
  blocks_[b] = block;
  marks_[b] = {};
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    const std::uint32_t row = size_++;
    const std::uint32_t entry = cells.entry(from, bit);
    const CellSums& sums = cells[entry];
    const Eigen::Vector3f mean = mean_of(cell_in(block.index, bit), sums, grid_.cell_size_m);
    entry_[row] = entry;
    x_[row] = mean.x();
    y_[row] = mean.y();
    z_[row] = mean.z();
    where_[row] = (b << 6U) | bit;
    points_[row] = sums.points;
  }
}

}  // namespace unimapper::onboard
