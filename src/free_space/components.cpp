#include "components.hpp"

namespace unimapper {

void ComponentLabels::split_block(std::uint32_t b, const LabelledCells& cells,
                                  std::uint32_t blocks_left) noexcept {
  Parts& own = parts_of_[b];
  own = {part_count_, 0, 0, 0, 0, false};
  low_[b] = cells.low;
  for (std::uint64_t left = cells.connecting; left != 0;) {
    // Every later block needs room for a part; where it grows short, what is left of a block
    // stands together.
    const std::uint64_t touching = flooded(lowest_bit(left), cells.connecting);
    const std::uint64_t part = is_short(max_parts_, blocks_left) ? left : touching;
    if (part != touching) ++crowded_;
    left &= ~part;
    cells_[part_count_] = part;
    component_[part_count_++] = kNone;
    ++own.count;
  }
}

}  // namespace unimapper
