#include "unimapper/free_space/components.hpp"

#include "unimapper/core/union_find.hpp"

namespace unimapper {

void ComponentLabels::split(std::uint32_t b, std::uint64_t connecting,
                            std::uint32_t blocks_left) noexcept {
  const std::uint32_t first = part_count_;
  for (std::uint64_t left = connecting; left != 0;) {
    // Every later block needs room for a part; where it grows short, what is left of a block
    // stands together.
    const bool is_short = part_count_ + blocks_left >= max_parts_;
    const std::uint64_t part = is_short ? left : flooded(lowest_bit(left), connecting);
    left &= ~part;
    parts_[part_count_] = {part, part_count_};
    ++part_count_;
  }
  parts_of_[b] = {first, part_count_ - first};
}

void ComponentLabels::join_blocks(std::uint32_t b, std::uint32_t other,
                                  std::size_t offset) noexcept {
  const auto [x, y, z] = kOffsets[offset];
  const Parts& mine = parts_of_[b];
  const Parts& others = parts_of_[other];
  if (others.count == 0) return;
  for (std::uint32_t p = mine.first; p < mine.first + mine.count; ++p) {
    if ((parts_[p].cells & kBorders[offset]) == 0) continue;
    const std::uint64_t touched = touched_in_neighbour(parts_[p].cells, x, y, z);
    for (std::uint32_t q = others.first; q < others.first + others.count; ++q) {
      if ((parts_[q].cells & touched) != 0) join(p, q);
    }
  }
}

std::uint64_t ComponentLabels::follow(std::uint32_t part, std::uint64_t touched, const Block& block,
                                      std::uint64_t low) noexcept {
  visit_rows(block, low & touched,
             [&](std::uint64_t, std::uint32_t row) noexcept { part_of_low_[row] = part; });
  return low & ~touched;
}

std::uint32_t ComponentLabels::flatten() noexcept {
  std::uint32_t roots = 0;
  for (std::uint32_t p = 0; p < part_count_; ++p) {
    parts_[p].parent = root(p);
    roots += parts_[p].parent == p ? 1U : 0U;
  }
  return roots;
}

std::uint32_t ComponentLabels::root(std::uint32_t part) noexcept {
  return find_root(part, [this](std::uint32_t p) -> std::uint32_t& { return parts_[p].parent; });
}

void ComponentLabels::join(std::uint32_t a, std::uint32_t b) noexcept {
  join_sets(a, b, [this](std::uint32_t p) -> std::uint32_t& { return parts_[p].parent; });
}

}  // namespace unimapper
