// Connected-component labelling of voxels
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>

#include "block.hpp"
#include "block_bits.hpp"
#include "src/core/parts.hpp"

namespace unimapper {

/// The cells of a block that take part in the labelling, one bit each.
struct LabelledCells {
  std::uint64_t connecting;  ///< join what they touch
  std::uint64_t low;         ///< follow a component that they touch, but connect nothing
};

/// Labels cells that touch (26 neighbours). Within a block they are flooded bit-parallel, and a
/// component spreads over the parts of other blocks that it touches. Low cells (kerbs, grass) would
/// tie every walker to the next wall: each follows one of the components it touches, the one in its
/// own block first, then what lies above.
class ComponentLabels {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;  ///< number of a block that is not there
  /// A block holds no more parts that do not touch each other.
  static constexpr std::uint32_t kMaxPartsPerBlock = 8;

  /// `memory.allocate<T>(count)` gives arrays that live as long as the labels: an `Arena` on the
  /// robot, the heap at the base. With fewer than `kMaxPartsPerBlock` parts per block, blocks that
  /// find no room have all their cells in one part. `max_parts` is at least `max_blocks`. For parts
  /// of low cells there is room for one more per block; where it grows short, all low cells of a
  /// block follow the same component.
  template <typename Memory>
  void allocate(Memory& memory, std::size_t max_blocks, std::size_t max_parts) {
    max_parts_ = static_cast<std::uint32_t>(max_parts);
    max_with_low_ = static_cast<std::uint32_t>(max_parts + max_blocks);
    parts_of_ = memory.template allocate<Parts>(max_blocks);
    low_ = memory.template allocate<std::uint64_t>(max_blocks);
    cells_ = memory.template allocate<std::uint64_t>(max_with_low_);
    component_ = memory.template allocate<std::uint32_t>(max_with_low_);
  }

  /// Labels the cells of `blocks` blocks. `cells_of(b)` gives the `LabelledCells` of block `b` and
  /// is called once, `neighbour(b, offset)` the number of the block next to it, or `kNone`. Returns
  /// the number of components; low cells that touch none are in none. O(blocks + parts).
  template <typename CellsOf, typename Neighbour>
  std::uint32_t label(std::uint32_t blocks, const CellsOf& cells_of,
                      const Neighbour& neighbour) noexcept;

  /// Begins to label in parts, for callers who have little time at once. `split`, `spread` and
  /// `add_low` follow, each through all `blocks` blocks.
  void begin() noexcept {
    part_count_ = size_ = next_block_ = crowded_ = 0;
    open_block_ = kNone;
  }
  /// Splits the cells of some blocks, in their order: parts are numbered in it.
  template <typename CellsOf>
  void split(Slice some, std::uint32_t blocks, const CellsOf& cells_of) noexcept;
  /// Finds components that hold any of the cells `signs_of(b)` of a block, or a low cell of them
  /// that follows; no other cells are labelled. Looks at `most` blocks, of which those that a
  /// component spreads from count four times; false once none is left.
  template <typename SignsOf, typename Neighbour>
  bool spread(std::uint32_t blocks, std::uint32_t most, const SignsOf& signs_of,
              const Neighbour& neighbour) noexcept;
  /// Makes the low cells of some blocks follow.
  template <typename Neighbour>
  void add_low(Slice some, std::uint32_t blocks, const Neighbour& neighbour) noexcept;

  /// Blocks without room for each of their parts, or for parts of their low cells.
  [[nodiscard]] std::uint32_t crowded() const noexcept { return crowded_; }
  /// Components, which are numbered from 0 on.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

  /// Calls `visit(component, cells)` for the labelled cells of block `b`, some at a time.
  template <typename Visit>
  void visit(std::uint32_t b, const Visit& visit) const noexcept {
    const Parts& own = parts_of_[b];
    if (!own.is_near) return;
    for (std::uint32_t p = own.first; p < own.first + own.count; ++p) {
      if (component_[p] != kNone) visit(component_[p], cells_[p]);
    }
    for (std::uint32_t p = own.first_low; p < own.first_low + own.low_count; ++p) {
      visit(component_[p], cells_[p]);
    }
  }

 private:
  /// A part is cells of one block that touch each other, the smallest thing a component is made of,
  /// or low cells of one block that follow the same one. The parts of a block follow each other,
  /// and so do those of its low cells, behind all others.
  struct Parts {
    std::uint32_t first;
    std::uint32_t first_low;  ///< before there are any: the open block after this one
    std::uint8_t count;
    std::uint8_t low_count;
    std::uint8_t open;  ///< parts of a component whose surroundings were not looked at, a bit each
    bool is_near;       ///< a part of it has a component, or one that its low cells touch
  };
  struct Part {
    std::uint32_t number;
    std::uint32_t block;
  };

  /// The 26 neighbours, upper ones first.
  static constexpr std::array<BlockOffset, 26> kOffsets{
      {{0, 0, 1},   {1, 0, 1},   {-1, 0, 1},  {0, 1, 1},   {0, -1, 1},  {1, 1, 1},   {-1, 1, 1},
       {1, -1, 1},  {-1, -1, 1}, {1, 0, 0},   {0, 1, 0},   {1, 1, 0},   {-1, 1, 0},  {-1, 0, 0},
       {0, -1, 0},  {-1, -1, 0}, {1, -1, 0},  {0, 0, -1},  {1, 0, -1},  {-1, 0, -1}, {0, 1, -1},
       {0, -1, -1}, {1, 1, -1},  {-1, 1, -1}, {1, -1, -1}, {-1, -1, -1}}};
  /// The cells of a block that touch the neighbour at each of `kOffsets`.
  static constexpr auto kBorders = [] {
    std::array<std::uint64_t, kOffsets.size()> borders{};
    for (std::size_t i = 0; i < kOffsets.size(); ++i) {
      for (std::uint32_t bit = 0; bit < Block::kCells; ++bit) {
        const std::uint64_t cell = std::uint64_t{1} << bit;
        const auto [x, y, z] = kOffsets[i];
        if (touched_in_neighbour(cell, x, y, z) != 0) borders[i] |= cell;
      }
    }
    return borders;
  }();

  /// Whether a part would take the number of the `blocks_left` blocks that are still to come.
  [[nodiscard]] bool is_short(std::uint32_t most, std::uint32_t blocks_left) const noexcept {
    return part_count_ + blocks_left >= most;
  }
  /// Splits the connecting cells of block `b`; `blocks_left` counts it and those after it.
  void split_block(std::uint32_t b, const LabelledCells& cells, std::uint32_t blocks_left) noexcept;
  /// Begins a component with a part that holds a sign, or that one of its signs follows. False if
  /// all such parts of block `b` have a component.
  template <typename Neighbour>
  bool begin_component(std::uint32_t b, std::uint64_t signs, const Neighbour& neighbour) noexcept;
  void take(const Part& part, std::uint32_t component) noexcept {
    component_[part.number] = component;
    Parts& own = parts_of_[part.block];
    own.is_near = true;
    if (own.open == 0) own.first_low = std::exchange(open_block_, part.block);
    own.open = static_cast<std::uint8_t>(own.open | 1U << (part.number - own.first));
  }
  /// Takes the parts of other blocks that a block's open parts touch into their components.
  template <typename Neighbour>
  void spread_from(std::uint32_t b, const Neighbour& neighbour) noexcept;
  template <typename Neighbour>
  void spread_from(const Part& part, const Neighbour& neighbour) noexcept;
  /// Calls `take(part, touched, low)` for the parts that low cells of block `b` touch, in the order
  /// in which they follow, with these cells and all that are left. It returns those that it took.
  template <typename Neighbour, typename Take>
  void visit_touched(std::uint32_t b, std::uint64_t low, const Neighbour& neighbour,
                     const Take& take) const noexcept;
  /// Attaches each low cell of block `b` to the first part it touches; `blocks_left` as in
  /// `split_block`.
  template <typename Neighbour>
  void add_low_cells(std::uint32_t b, const Neighbour& neighbour,
                     std::uint32_t blocks_left) noexcept;

  std::uint32_t part_count_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t open_block_ = kNone;  ///< the first of those with open parts
  std::uint32_t next_block_ = 0;      ///< where the next component may begin
  std::uint32_t crowded_ = 0;
  std::uint32_t max_parts_ = 0;
  std::uint32_t max_with_low_ = 0;
  Parts* parts_of_ = nullptr;           ///< by block
  std::uint64_t* low_ = nullptr;        ///< cells that are to follow a part, by block
  std::uint64_t* cells_ = nullptr;      ///< by part
  std::uint32_t* component_ = nullptr;  ///< by part, or `kNone`
};

template <typename CellsOf, typename Neighbour>
std::uint32_t ComponentLabels::label(std::uint32_t blocks, const CellsOf& cells_of,
                                     const Neighbour& neighbour) noexcept {
  begin();
  split({0, blocks}, blocks, cells_of);
  const auto all = [](std::uint32_t) { return ~std::uint64_t{0}; };
  while (spread(blocks, UINT32_MAX, all, neighbour)) {
  }
  add_low({0, blocks}, blocks, neighbour);
  return size_;
}

template <typename CellsOf>
void ComponentLabels::split(Slice some, std::uint32_t blocks, const CellsOf& cells_of) noexcept {
  for (std::uint32_t b = some.first; b < some.end; ++b) split_block(b, cells_of(b), blocks - b);
}

template <typename SignsOf, typename Neighbour>
bool ComponentLabels::spread(std::uint32_t blocks, std::uint32_t most, const SignsOf& signs_of,
                             const Neighbour& neighbour) noexcept {
  constexpr std::uint32_t kAround = 4;
  while (most > 0) {
    most -= std::min(most, open_block_ != kNone ? kAround : 1U);
    if (open_block_ != kNone) {
      spread_from(std::exchange(open_block_, parts_of_[open_block_].first_low), neighbour);
    } else if (next_block_ == blocks) {
      return false;
    } else {
      const std::uint64_t signs = signs_of(next_block_);
      if (signs == 0 || !begin_component(next_block_, signs, neighbour)) ++next_block_;
    }
  }
  return true;
}

template <typename Neighbour>
bool ComponentLabels::begin_component(std::uint32_t b, std::uint64_t signs,
                                      const Neighbour& neighbour) noexcept {
  const Parts& own = parts_of_[b];
  for (std::uint32_t p = own.first; p < own.first + own.count; ++p) {
    if ((cells_[p] & signs) == 0 || component_[p] != kNone) continue;
    take({p, b}, size_++);
    return true;
  }
  const std::uint32_t before = size_;
  visit_touched(b, low_[b] & signs, neighbour,
                [&](const Part& part, std::uint64_t touched, std::uint64_t low) noexcept {
                  if (component_[part.number] != kNone) return touched;
                  take(part, size_++);
                  return low;
                });
  return size_ != before;
}

template <typename Neighbour>
void ComponentLabels::spread_from(std::uint32_t b, const Neighbour& neighbour) noexcept {
  Parts& own = parts_of_[b];
  for (std::uint32_t left = std::exchange(own.open, std::uint8_t{0}); left != 0; left &= left - 1) {
    spread_from(Part{own.first + static_cast<std::uint32_t>(std::countr_zero(left)), b}, neighbour);
  }
}

template <typename Neighbour>
void ComponentLabels::spread_from(const Part& part, const Neighbour& neighbour) noexcept {
  const std::uint64_t cells = cells_[part.number];
  const std::uint32_t component = component_[part.number];
  for (std::size_t i = 0; i < kOffsets.size(); ++i) {
    if ((cells & kBorders[i]) == 0) continue;
    const std::uint32_t other = neighbour(part.block, kOffsets[i]);
    if (other == kNone) continue;
    const auto [x, y, z] = kOffsets[i];
    const std::uint64_t touched = touched_in_neighbour(cells, x, y, z);
    Parts& others = parts_of_[other];
    if ((low_[other] & touched) != 0) others.is_near = true;
    for (std::uint32_t q = others.first; q < others.first + others.count; ++q) {
      if (component_[q] == kNone && (cells_[q] & touched) != 0) take({q, other}, component);
    }
  }
}

template <typename Neighbour, typename Take>
void ComponentLabels::visit_touched(std::uint32_t b, std::uint64_t low, const Neighbour& neighbour,
                                    const Take& take) const noexcept {
  const Parts& own = parts_of_[b];
  for (std::uint32_t p = own.first; p < own.first + own.count && low != 0; ++p) {
    const std::uint64_t touched = low & dilated(cells_[p]);
    if (touched != 0) low &= ~take(Part{p, b}, touched, low);
  }
  for (std::size_t i = 0; i < kOffsets.size() && low != 0; ++i) {
    if ((low & kBorders[i]) == 0) continue;
    const auto [x, y, z] = kOffsets[i];
    const std::uint32_t other = neighbour(b, kOffsets[i]);
    if (other == kNone) continue;
    const Parts& others = parts_of_[other];
    for (std::uint32_t p = others.first; p < others.first + others.count && low != 0; ++p) {
      const std::uint64_t touched = low & touched_in_neighbour(cells_[p], -x, -y, -z);
      if (touched != 0) low &= ~take(Part{p, other}, touched, low);
    }
  }
}

template <typename Neighbour>
void ComponentLabels::add_low(Slice some, std::uint32_t blocks,
                              const Neighbour& neighbour) noexcept {
  for (std::uint32_t b = some.first; b < some.end; ++b) {
    if (parts_of_[b].is_near && low_[b] != 0) add_low_cells(b, neighbour, blocks - b);
  }
}

template <typename Neighbour>
void ComponentLabels::add_low_cells(std::uint32_t b, const Neighbour& neighbour,
                                    std::uint32_t blocks_left) noexcept {
  Parts& own = parts_of_[b];
  own.first_low = part_count_;
  own.low_count = 0;
  visit_touched(b, low_[b], neighbour,
                [&](const Part& part, std::uint64_t touched, std::uint64_t low) noexcept {
                  if (component_[part.number] == kNone) return touched;
                  // As in `split_block`.
                  const std::uint64_t following =
                      is_short(max_with_low_, blocks_left) ? low : touched;
                  if (following != touched) ++crowded_;
                  cells_[part_count_] = following;
                  component_[part_count_++] = component_[part.number];
                  ++own.low_count;
                  return following;
                });
}

/// How a component is decided about.
enum class ComponentClass : std::uint8_t {
  kMixed,    ///< every cell by its own evidence
  kStatic,   ///< all of it
  kDynamic,  ///< all of it but cells that are confirmed static
};

/// By the share of a component that is dynamic, in whatever measure: dynamic from `dynamic_share`
/// on, static below `static_share`. Nothing at all (`all` is 0) is a share of 0.
[[nodiscard]] inline ComponentClass classify(std::uint32_t dynamic, std::uint32_t all,
                                             float dynamic_share, float static_share) noexcept {
  const float share = all == 0 ? 0.0F : static_cast<float>(dynamic) / static_cast<float>(all);
  if (share >= dynamic_share) return ComponentClass::kDynamic;
  return share < static_share ? ComponentClass::kStatic : ComponentClass::kMixed;
}

}  // namespace unimapper
