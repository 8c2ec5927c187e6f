#include "cell_table.hpp"

#include <array>
#include <bit>

namespace unimapper::onboard {
namespace {

using Lanes = float __attribute__((vector_size(16)));

/// Where the cells of a block lie from its first one. Single precision holds indices exactly.
constexpr std::array<Lanes, Block::kCells> kCellOfBlock = [] {
  std::array<Lanes, Block::kCells> cells{};
  for (std::uint32_t bit = 0; bit < Block::kCells; ++bit) {
    const VoxelIndex cell = cell_in({0, 0, 0}, bit);
    cells[bit] = Lanes{static_cast<float>(cell.x), static_cast<float>(cell.y),
                       static_cast<float>(cell.z), 0.0F};
  }
  return cells;
}();

}  // namespace

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
  const float cell_size_m = grid_.cell_size_m;
  const VoxelIndex corner = cell_in(block.index, 0);
  const Lanes lower = {static_cast<float>(corner.x), static_cast<float>(corner.y),
                       static_cast<float>(corner.z), 0.0F};
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1, ++row) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    const std::uint32_t entry = cells.entry(from, bit);
    const CellSums& sums = cells[entry];
    // As `mean_of`, all axes at a time.
    const float inverse = 1.0F / static_cast<float>(sums.points);
    const Lanes mean =
        (lower + kCellOfBlock[bit] + Lanes{sums.x, sums.y, sums.z, 0.0F} * inverse) * cell_size_m;
    entry_[row] = entry;
    x_[row] = mean[0];
    y_[row] = mean[1];
    z_[row] = mean[2];
    where_[row] = (b << 6U) | bit;
    points_[row] = sums.points;
  }
  return row;
}

}  // namespace unimapper::onboard
