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

void CellTable::add(const CellStore& cells, std::span<const std::uint32_t> order, Slice some,
                    const Executor& executor) noexcept {
  constexpr std::uint32_t kAhead = 4;  // blocks whose sums are loaded in advance
  const Cut cut(executor, some, kBlocksPerPart);
  std::uint32_t first[Cut::kMost];
  count_before(executor, cut, size_, first, [&](Slice part) noexcept {
    std::uint32_t rows = 0;
    for (std::uint32_t i = part.first; i < part.end; ++i) {
      rows += popcount(cells.occupied()[order[i]]);
    }
    return rows;
  });
  for_parts(executor, cut.parts(), [&](std::uint32_t part, std::uint32_t) noexcept {
    std::uint32_t row = first[part];
    for (std::uint32_t i = cut[part].first; i < cut[part].end; ++i) {
      if (i + 2 * kAhead < order.size()) cells.prefetch_block(order[i + 2 * kAhead]);
      if (i + kAhead < order.size()) cells.prefetch_sums_of(order[i + kAhead]);
      row = add_block(cells, order[i], i, row);
    }
    if (cut[part].end == some.end) size_ = row;
  });
  block_count_ = some.end;
}

std::uint32_t CellTable::add_block(const CellStore& cells, std::uint32_t from, std::uint32_t b,
                                   std::uint32_t row) noexcept {
  const Block block{cells.occupied()[from], cells.index(from), row};
  blocks_[b] = block;
  marks_[b] = {};
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1, ++row) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
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
  return row;
}

}  // namespace unimapper::onboard
