#include "components.hpp"

namespace unimapper {

void ComponentLabels::split_block(std::uint32_t b, const LabelledCells& cells,
                                  std::uint32_t blocks_left, Room& room) noexcept {
  Parts& own = parts_of_[b];
  own = {room.next, 0, 0, 0};
  low_[b] = cells.low;
  for (std::uint64_t left = cells.connecting; left != 0;) {
    // Every later block needs room for a part; where it grows short, what is left of a block
    // stands together.
    const std::uint64_t part =
        room.is_short(blocks_left) ? left : flooded(lowest_bit(left), cells.connecting);
    left &= ~part;
    cells_[room.next] = part;
    parent_[room.next] = room.next;
    ++room.next;
    ++own.count;
  }
}

std::uint64_t ComponentLabels::follow(std::uint32_t part, std::uint64_t touched, std::uint64_t low,
                                      Parts& own, std::uint32_t blocks_left, Room& room) noexcept {
  if ((low & touched) == 0) return low;
  // As in `split_block`.
  const std::uint64_t following = room.is_short(blocks_left) ? low : low & touched;
  cells_[room.next] = following;
  parent_[room.next++] = parent_[part];
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

}  // namespace unimapper
