// Connected-component labelling of voxels
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "block.hpp"
#include "block_bits.hpp"
#include "src/core/parts.hpp"
#include "src/core/union_find.hpp"

namespace unimapper {

/// The cells of a block that take part in the labelling, one bit each.
struct LabelledCells {
  std::uint64_t connecting;  ///< join what they touch
  std::uint64_t low;         ///< follow a component that they touch, but connect nothing
};

/// Labels cells that touch (26 neighbours). Within a block they are flooded bit-parallel; parts of
/// different blocks that touch are joined (union-find). Low cells (kerbs, grass) would tie every
/// walker to the next wall: each follows one of the components it touches, the one in its own block
/// first, then what lies above.
class ComponentLabels {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;  ///< label of a cell without a component
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
    parent_ = memory.template allocate<std::uint32_t>(max_with_low_);
  }

  /// Labels the cells of `blocks` blocks. `cells_of(b)` gives the `LabelledCells` of block `b` and
  /// is called once, `neighbour(b, offset)` the number of the block next to it, or `kNone`. Returns
  /// the number of components; low cells that touch none are in none. O(blocks + parts).
  template <typename CellsOf, typename Neighbour>
  std::uint32_t label(std::uint32_t blocks, const CellsOf& cells_of, const Neighbour& neighbour,
                      const Executor& executor = {}) noexcept;

  /// Begins to label in parts, for callers who have little time at once. `split`, `join`, `count`
  /// and `add_low` follow. Each goes through all `blocks` blocks in their order, as many at a time
  /// as the caller likes. Workers share what takes long; the components do not depend on them.
  void begin() noexcept { part_count_ = size_ = 0; }
  /// Splits the cells of some blocks. One worker does it, for parts are numbered in its order.
  template <typename CellsOf>
  void split(Slice some, std::uint32_t blocks, const CellsOf& cells_of) noexcept;
  /// Joins what touches across their sides.
  template <typename Neighbour>
  void join(Slice some, std::uint32_t blocks, const Neighbour& neighbour,
            const Executor& executor = {}) noexcept;
  /// Returns the number of components. O(parts).
  std::uint32_t count() noexcept { return flatten(); }
  /// Makes their low cells follow. Shared only if it is all of them.
  template <typename Neighbour>
  void add_low(Slice some, std::uint32_t blocks, const Neighbour& neighbour,
               const Executor& executor = {}) noexcept;

  /// Components are numbered, with gaps, below this.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

  /// Calls `visit(component, cells)` for the labelled cells of block `b`, some at a time.
  template <typename Visit>
  void visit(std::uint32_t b, const Visit& visit) const noexcept {
    const Parts& own = parts_of_[b];
    for (std::uint32_t p = own.first; p < own.first + own.count; ++p) {
      visit(parent_[p], cells_[p]);
    }
    for (std::uint32_t p = own.first_low; p < own.first_low + own.low_count; ++p) {
      visit(parent_[p], cells_[p]);
    }
  }

 private:
  /// A part is cells of one block that touch each other, the smallest thing a component is made of,
  /// or low cells of one block that follow the same one. The parts of a block follow each other,
  /// and so do those of its low cells, behind all others.
  struct Parts {
    std::uint32_t first;
    std::uint32_t first_low;
    std::uint8_t count;
    std::uint8_t low_count;
  };

  /// The 26 neighbours, upper ones first. The first half meets every touching pair once.
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

  [[nodiscard]] static std::uint32_t bit_number(std::uint64_t cells) noexcept {
    return static_cast<std::uint32_t>(std::countr_zero(cells));
  }

  /// Numbers for the parts of some blocks.
  struct Room {
    std::uint32_t next;
    std::uint32_t end;
    bool was_short = false;

    /// Whether a part would take the number of the `blocks_left` blocks that are still to come.
    bool is_short(std::uint32_t blocks_left) noexcept {
      if (next + blocks_left < end) return false;
      return was_short = true;
    }
  };
  /// Blocks of a part of the work. Fewer parts have fewer sides to be joined by one worker.
  [[nodiscard]] static Cut cut(const Executor& executor, Slice blocks) noexcept {
    constexpr std::uint32_t kParts = 16;
    constexpr std::uint32_t kLeast = 256;
    return {executor, blocks, std::max(kLeast, blocks.size() / kParts + 1)};
  }
  /// Splits the connecting cells of block `b`; `blocks_left` counts it and those after it.
  void split_block(std::uint32_t b, const LabelledCells& cells, std::uint32_t blocks_left,
                   Room& room) noexcept;
  /// The cells that `split_block` was given.
  [[nodiscard]] std::uint64_t connecting(const Parts& parts) const noexcept {
    std::uint64_t cells = 0;
    for (std::uint32_t p = parts.first; p < parts.first + parts.count; ++p) cells |= cells_[p];
    return cells;
  }
  /// Calls `touch(p, other, q)` for the parts p of some blocks and q of block `other` that touch;
  /// each pair comes once. Ends where that returns false, with the number of the block.
  template <typename Neighbour, typename Touch>
  std::uint32_t visit_touching(Slice some, const Neighbour& neighbour,
                               const Touch& touch) const noexcept;
  /// The parts of a block and those of its neighbour at `kOffsets[offset]`.
  template <typename Touch>
  bool visit_touching_in(std::uint32_t b, std::uint32_t other, std::size_t offset,
                         const Touch& touch) const noexcept;
  template <typename Neighbour>
  void join_alone(Slice some, const Neighbour& neighbour) noexcept;
  template <typename Neighbour>
  void add_low_alone(Slice some, std::uint32_t end, const Neighbour& neighbour,
                     Room& room) noexcept;
  /// Attaches each low cell of block `b` to the first part it touches; `blocks_left` as in
  /// `split_block`.
  template <typename Neighbour>
  void add_low_cells(std::uint32_t b, const Neighbour& neighbour, std::uint32_t blocks_left,
                     Room& room) noexcept;
  /// Makes those of the low cells that are among `touched` follow a part. Returns the others.
  std::uint64_t follow(std::uint32_t part, std::uint64_t touched, std::uint64_t low, Parts& own,
                       std::uint32_t blocks_left, Room& room) noexcept;
  std::uint32_t root(std::uint32_t part) noexcept;
  void join_parts(std::uint32_t a, std::uint32_t b) noexcept {
    join_sets(a, b, [this](std::uint32_t p) -> std::uint32_t& { return parent_[p]; });
  }
  /// Makes every part's parent its root. Returns the number of roots.
  std::uint32_t flatten() noexcept;

  std::uint32_t part_count_ = 0;
  std::uint32_t size_ = 0;  ///< parts that connect
  std::uint32_t max_parts_ = 0;
  std::uint32_t max_with_low_ = 0;
  Parts* parts_of_ = nullptr;       ///< by block
  std::uint64_t* low_ = nullptr;    ///< cells that are to follow a part, by block
  std::uint64_t* cells_ = nullptr;  ///< by part
  /// By part: union-find; a root is its own parent. After `label`: the root.
  std::uint32_t* parent_ = nullptr;
};

template <typename CellsOf, typename Neighbour>
std::uint32_t ComponentLabels::label(std::uint32_t blocks, const CellsOf& cells_of,
                                     const Neighbour& neighbour,
                                     const Executor& executor) noexcept {
  begin();
  split({0, blocks}, blocks, cells_of);
  join({0, blocks}, blocks, neighbour, executor);
  const std::uint32_t components = count();
  add_low({0, blocks}, blocks, neighbour, executor);
  return components;
}

template <typename CellsOf>
void ComponentLabels::split(Slice some, std::uint32_t blocks, const CellsOf& cells_of) noexcept {
  Room room{part_count_, max_parts_};
  for (std::uint32_t b = some.first; b < some.end; ++b) {
    split_block(b, cells_of(b), blocks - b, room);
  }
  part_count_ = size_ = room.next;
}

template <typename Neighbour, typename Touch>
std::uint32_t ComponentLabels::visit_touching(Slice some, const Neighbour& neighbour,
                                              const Touch& touch) const noexcept {
  for (std::uint32_t b = some.first; b < some.end; ++b) {
    const std::uint64_t cells = connecting(parts_of_[b]);
    if (cells == 0) continue;
    for (std::size_t i = 0; i < kOffsets.size() / 2; ++i) {
      if ((cells & kBorders[i]) == 0) continue;
      const std::uint32_t other = neighbour(b, kOffsets[i]);
      if (other != kNone && !visit_touching_in(b, other, i, touch)) return b;
    }
  }
  return some.end;
}

template <typename Touch>
bool ComponentLabels::visit_touching_in(std::uint32_t b, std::uint32_t other, std::size_t offset,
                                        const Touch& touch) const noexcept {
  const auto [x, y, z] = kOffsets[offset];
  const Parts& mine = parts_of_[b];
  const Parts& others = parts_of_[other];
  if (others.count == 0) return true;
  for (std::uint32_t p = mine.first; p < mine.first + mine.count; ++p) {
    if ((cells_[p] & kBorders[offset]) == 0) continue;
    const std::uint64_t touched = touched_in_neighbour(cells_[p], x, y, z);
    for (std::uint32_t q = others.first; q < others.first + others.count; ++q) {
      if ((cells_[q] & touched) != 0 && !touch(p, other, q)) return false;
    }
  }
  return true;
}

template <typename Neighbour>
void ComponentLabels::join_alone(Slice some, const Neighbour& neighbour) noexcept {
  visit_touching(some, neighbour, [this](std::uint32_t p, std::uint32_t, std::uint32_t q) noexcept {
    join_parts(p, q);
    return true;
  });
}

// A worker joins what lies within its share of the blocks; of no other share it knows what is
// joined already. What touches another one is noted behind all shares, and joined by one worker.
template <typename Neighbour>
void ComponentLabels::join(Slice some, std::uint32_t blocks, const Neighbour& neighbour,
                           const Executor& executor) noexcept {
  if (executor.workers == 1) return join_alone(some, neighbour);
  struct Noted {
    std::uint32_t count;
    std::uint32_t end;  // block from which on there was no room
  } noted[Cut::kMost];
  const Cut parts = cut(executor, some);
  const std::uint32_t room = (max_with_low_ - part_count_) / std::max(parts.parts(), 1U);
  // Blocks of an earlier slice may have joined some of these with theirs.
  const bool is_all = some.size() == blocks;
  for_parts(executor, parts.parts(), [&](std::uint32_t part, std::uint32_t) noexcept {
    const Slice own = parts[part];
    std::uint64_t* const pairs = cells_ + part_count_ + part * room;
    std::uint32_t count = 0;
    const std::uint32_t end = visit_touching(
        own, neighbour, [&](std::uint32_t p, std::uint32_t other, std::uint32_t q) noexcept {
          if (is_all && other - own.first < own.size()) {
            join_parts(p, q);
            return true;
          }
          if (count == room) return false;
          pairs[count++] = std::uint64_t{p} << 32U | q;
          return true;
        });
    noted[part] = {count, end};
  });
  for (std::uint32_t part = 0; part < parts.parts(); ++part) {
    const std::uint64_t* const pairs = cells_ + part_count_ + part * room;
    for (std::uint32_t i = 0; i < noted[part].count; ++i) {
      join_parts(static_cast<std::uint32_t>(pairs[i] >> 32U), static_cast<std::uint32_t>(pairs[i]));
    }
    join_alone({noted[part].end, parts[part].end}, neighbour);
  }
}

template <typename Neighbour>
void ComponentLabels::add_low_alone(Slice some, std::uint32_t end, const Neighbour& neighbour,
                                    Room& room) noexcept {
  for (std::uint32_t b = some.first; b < some.end; ++b) {
    if (low_[b] != 0) add_low_cells(b, neighbour, end - b, room);
  }
}

// Each part has a share of the numbers that are left. Where one grows short of them, one worker
// does all again, who grows short later.
template <typename Neighbour>
void ComponentLabels::add_low(Slice some, std::uint32_t blocks, const Neighbour& neighbour,
                              const Executor& executor) noexcept {
  Room room{part_count_, max_with_low_};
  if (executor.workers > 1 && some.size() == blocks) {
    const Cut parts = cut(executor, some);
    const auto number_of = [&](std::uint32_t block) noexcept {
      return room.next +
             static_cast<std::uint32_t>(std::uint64_t{room.end - room.next} * block / blocks);
    };
    bool was_short[Cut::kMost];
    for_parts(executor, parts.parts(), [&](std::uint32_t part, std::uint32_t) noexcept {
      const Slice own = parts[part];
      Room share{number_of(own.first), number_of(own.end)};
      add_low_alone(own, own.end, neighbour, share);
      was_short[part] = share.was_short;
    });
    if (std::none_of(was_short, was_short + parts.parts(), [](bool is) { return is; })) return;
  }
  add_low_alone(some, blocks, neighbour, room);
  part_count_ = room.next;
}

template <typename Neighbour>
void ComponentLabels::add_low_cells(std::uint32_t b, const Neighbour& neighbour,
                                    std::uint32_t blocks_left, Room& room) noexcept {
  Parts& own = parts_of_[b];
  own.first_low = room.next;
  own.low_count = 0;
  std::uint64_t low = low_[b];
  for (std::uint32_t p = own.first; p < own.first + own.count && low != 0; ++p) {
    low = follow(p, dilated(cells_[p]), low, own, blocks_left, room);
  }
  for (std::size_t i = 0; i < kOffsets.size() && low != 0; ++i) {
    if ((low & kBorders[i]) == 0) continue;
    const auto [x, y, z] = kOffsets[i];
    const std::uint32_t other = neighbour(b, kOffsets[i]);
    if (other == kNone) continue;
    const Parts& others = parts_of_[other];
    for (std::uint32_t p = others.first; p < others.first + others.count; ++p) {
      low = follow(p, touched_in_neighbour(cells_[p], -x, -y, -z), low, own, blocks_left, room);
    }
  }
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
