#include "components.hpp"

#include "src/core/union_find.hpp"

namespace unimapper {

void ComponentLabels::split_block(std::uint32_t b, const LabelledCells& cells,
                                  std::uint32_t blocks_left) noexcept {
  Parts& own = parts_of_[b];
  own = {part_count_, 0, 0, 0};
  low_[b] = cells.low;
  for (std::uint64_t left = cells.connecting; left != 0;) {
    // Every later block needs room for a part; where it grows short, what is left of a block
    // stands together.
    const bool is_short = part_count_ + blocks_left >= max_parts_;
    const std::uint64_t part = is_short ? left : flooded(lowest_bit(left), cells.connecting);
    left &= ~part;
    cells_[part_count_] = part;
    parent_[part_count_] = part_count_;
    ++part_count_;
    ++own.count;
  }
}

void ComponentLabels::join_blocks(std::uint32_t b, std::uint32_t other,
                                  std::size_t offset) noexcept {
  const auto [x, y, z] = kOffsets[offset];
  const Parts& mine = parts_of_[b];
  const Parts& others = parts_of_[other];
  if (others.count == 0) return;
  for (std::uint32_t p = mine.first; p < mine.first + mine.count; ++p) {
    if ((cells_[p] & kBorders[offset]) == 0) continue;
    const std::uint64_t touched = touched_in_neighbour(cells_[p], x, y, z);
    for (std::uint32_t q = others.first; q < others.first + others.count; ++q) {
      if ((cells_[q] & touched) != 0) join_parts(p, q);
    }
  }
}

std::uint64_t ComponentLabels::follow(std::uint32_t part, std::uint64_t touched, std::uint64_t low,
                                      Parts& own, std::uint32_t blocks_left) noexcept {
  if ((low & touched) == 0) return low;
  // As in `split_block`.
  const bool is_short = part_count_ + blocks_left >= max_with_low_;
  const std::uint64_t following = is_short ? low : low & touched;
  cells_[part_count_] = following;
  parent_[part_count_++] = parent_[part];
  ++own.low_count;
  return low & ~following;
}

std::uint32_t ComponentLabels::flatten() noexcept {
  std::uint32_t roots = 0;
  for (std::uint32_t p = 0; p < part_count_; ++p) {
    parent_[p] = root(p);
    roots += parent_[p] == p ? 1U : 0U;
  }
  return roots;
}

std::uint32_t ComponentLabels::root(std::uint32_t part) noexcept {
  return find_root(part, [this](std::uint32_t p) -> std::uint32_t& { return parent_[p]; });
}

void ComponentLabels::join_parts(std::uint32_t a, std::uint32_t b) noexcept {
  join_sets(a, b, [this](std::uint32_t p) -> std::uint32_t& { return parent_[p]; });
}

}  // namespace unimapper
