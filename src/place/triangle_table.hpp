// Triangle hash table with bounded buckets.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "src/core/prefetch.hpp"
#include "src/core/voxel_key.hpp"
#include "triangles.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::place {

/// A stored triangle that equals a query's: the slot of its place, and its pose there.
struct TriangleEntry {
  std::uint32_t slot;          ///< of the place
  std::uint16_t heading;       ///< as in `Triangle`
  std::int16_t center_cm[2];   ///< as in `Triangle`
  std::uint8_t agreeing_dots;  ///< how many of the three products are equal within tolerance
};

/// Maps triangles to the slots of the places that have them. A hash cell is as wide as the
/// tolerance is on both sides together, so that 8 cells hold everything within tolerance of a
/// query; in a table for more than four million triangles it is half as wide, for fewer comparisons
/// with triangles out of tolerance. Chirality is part of the key. Every bucket is a chain of
/// blocks, and bounded.
class TriangleTable {
 public:
  void allocate(Arena& arena, const LoopSearchConfig& config) noexcept;

  /// False, and nothing stored, if the bucket or the table is full. O(1).
  bool insert(const Triangle& triangle, std::uint32_t slot) noexcept;

  /// Removes one entry of `slot` equal to `triangle`, if there is one. O(bucket).
  void remove(const Triangle& triangle, std::uint32_t slot) noexcept;

  /// Calls `visit(entry)` for every stored triangle whose sides and chirality equal those of
  /// `triangle` within the tolerance and whose columns are similar at the three vertices;
  /// `TriangleEntry::agreeing_dots` counts the products of normals that agree.
  template <typename Visitor>
  void find(const Triangle& triangle, Visitor&& visit) const noexcept {
    // Blocks and entries are scattered in memory. All chains are walked side by side, and what the
    // next round needs is prefetched in this one: many cache misses overlap.
    struct Chain {
      std::uint64_t cell;
      std::uint32_t at;
      Window window;
    } chains[kMaxCells];
    std::uint32_t open = 0;
    for_each_cell(triangle, [&](std::uint64_t cell, const Window& window) {
      const std::uint32_t head = heads_[bucket_of(cell)];
      if (head == 0) return;
      prefetch(head);
      chains[open++] = {cell, head, window};
    });
    Found found;
    while (open > 0) {
      for (std::uint32_t c = 0; c < open;) {
        Chain& chain = chains[c];
        const Block* block = &blocks_[chain.at];
        if (block->cell == chain.cell) {
          if (found.count + 2 * kBlock > Found::kCapacity) visit_all(found, triangle, visit);
          collect(chain.at, matches(*block, chain.window, triangle), found);
        }
        if (block->has_second != 0) {
          const std::uint32_t second = block->next;
          block = &blocks_[second];
          if (block->cell == chain.cell) {
            collect(second, matches(*block, chain.window, triangle), found);
          }
        }
        chain.at = block->next;
        if (chain.at == 0) {
          chain = chains[--open];
        } else {
          prefetch(chain.at);
          ++c;
        }
      }
    }
    visit_all(found, triangle, visit);
  }

  /// How many entries `find` would compare, at least: the cost of a query's triangle. At most 27 x
  /// `max_bucket`.
  [[nodiscard]] std::uint32_t entries_near(const Triangle& triangle) const noexcept {
    std::uint32_t count = 0;
    for_each_cell(triangle,
                  [&](std::uint64_t cell, const Window&) { count += stored_[bucket_of(cell)]; });
    return count;
  }

  /// Bytes that one stored triangle takes.
  static constexpr std::size_t entry_bytes() noexcept {
    return sizeof(Entry) + sizeof(Block) / kBlock;
  }

 private:
  static constexpr std::uint32_t kBlock = 8;
  static constexpr std::uint32_t kDotBits = 5;
  static constexpr std::int32_t kLargestDot = (1 << kDotBits) - 1;
  static constexpr std::uint32_t kMaxCells = 27;     // that the tolerance around a triangle touches
  static constexpr std::uint32_t kSlotBits = 17;     // of those in an entry
  static constexpr std::uint32_t kHighSlotBits = 3;  // the rest, in the block
  static_assert(kSlotBits + kHighSlotBits == 20, "bits of the most `LoopSearchConfig::max_places`");
  // Up to 8 triangles of one cell: what decides whether they equal a query, attribute by
  // attribute, so that one vector instruction compares one attribute of all. One cache line. A pair
  // of blocks is filled before a cell begins another one, which comes first in the chain.
  struct alignas(64) Block {
    std::uint64_t cell;
    std::uint32_t next;            // 0 ends the chain
    std::uint32_t count : 7;       // triangles in the block
    std::uint32_t has_second : 1;  // the next block goes with it: it was begun when this was full
    std::uint32_t high_slots : kHighSlotBits* kBlock;
    std::uint8_t side_cm[3][kBlock];  // above the lower end of the cell
    std::uint8_t sketch[3][kBlock];
  };
  // What is read of those that do. The triangle at position i of block b has entry 8 b + i.
  struct Entry {
    std::uint16_t low_slot;       // 16 bits
    std::uint16_t slot_and_dots;  // one bit more, and three products of normals, 5 bits each
    std::uint16_t heading;
    std::int16_t center_cm[2];
  };
  // Which offsets within a cell are within tolerance of a query.
  struct Window {
    std::uint8_t low[3];
    std::uint8_t span[3];
  };
  // Entries prefetched and not visited yet.
  struct Found {
    static constexpr std::uint32_t kCapacity = 64;
    std::uint32_t count = 0;
    std::uint32_t entry[kCapacity];
  };

  void prefetch(std::uint32_t block) const noexcept { prefetch_for_read(&blocks_[block]); }
  void collect(std::uint32_t block, std::uint32_t hits, Found& found) const noexcept {
    for (; hits != 0; hits &= hits - 1) {
      const std::uint32_t entry =
          block * kBlock + static_cast<std::uint32_t>(std::countr_zero(hits));
      prefetch_for_read(&entries_[entry]);
      found.entry[found.count++] = entry;
    }
  }
  template <typename Visitor>
  void visit_all(Found& found, const Triangle& triangle, Visitor&& visit) const noexcept {
    for (std::uint32_t i = 0; i < found.count; ++i) {
      visit(entry_at(found.entry[i], triangle));
    }
    found.count = 0;
  }

  static std::uint64_t cell_key(std::int32_t a, std::int32_t b, std::int32_t c,
                                std::uint32_t left_handed) noexcept {
    return (static_cast<std::uint64_t>(a) << 42U) | (static_cast<std::uint64_t>(b) << 22U) |
           (static_cast<std::uint64_t>(c) << 2U) | left_handed;
  }
  // Calls `visit` with every cell that may hold an equal of `triangle`, and where in it.
  template <typename Visitor>
  void for_each_cell(const Triangle& triangle, Visitor&& visit) const noexcept {
    if (block_count_ == 0) return;
    std::int32_t low[3];
    std::int32_t high[3];
    for (int i = 0; i < 3; ++i) {
      low[i] = std::max(0, triangle.side_cm[i] - tolerance_cm_);
      high[i] = triangle.side_cm[i] + tolerance_cm_;
    }
    Window window;
    const auto narrow = [&](int side, std::int32_t cell) {
      const std::int32_t first = std::max(0, low[side] - cell * cell_cm_);
      const std::int32_t last = std::min(cell_cm_ - 1, high[side] - cell * cell_cm_);
      window.low[side] = static_cast<std::uint8_t>(first);
      window.span[side] = static_cast<std::uint8_t>(last - first);
    };
    for (std::int32_t a = low[0] / cell_cm_; a <= high[0] / cell_cm_; ++a) {
      narrow(0, a);
      for (std::int32_t b = std::max(a, low[1] / cell_cm_); b <= high[1] / cell_cm_; ++b) {
        narrow(1, b);
        // Cells whose sides do not ascend or do not close hold nothing.
        const std::int32_t last = std::min(high[2] / cell_cm_, a + b + 1);
        for (std::int32_t c = std::max(b, low[2] / cell_cm_); c <= last; ++c) {
          narrow(2, c);
          visit(cell_key(a, b, c, triangle.left_handed), window);
        }
      }
    }
  }
  [[nodiscard]] std::uint64_t cell_of(const Triangle& triangle) const noexcept {
    return cell_key(triangle.side_cm[0] / cell_cm_, triangle.side_cm[1] / cell_cm_,
                    triangle.side_cm[2] / cell_cm_, triangle.left_handed);
  }
  [[nodiscard]] std::uint32_t bucket_of(std::uint64_t cell) const noexcept {
    return static_cast<std::uint32_t>(mix_bits(cell)) & bucket_mask_;
  }
  // Takes a free block, whose chain goes on with `next`; 0 if there is none.
  std::uint32_t take_block(std::uint64_t cell, std::uint32_t next) noexcept;
  // The block of a cell's newest pair that has its latest triangle.
  [[nodiscard]] std::uint32_t latest(std::uint32_t first) const noexcept {
    return blocks_[first].has_second != 0 ? blocks_[first].next : first;
  }
  void store(std::uint32_t block, std::uint32_t at, const Triangle& triangle,
             std::uint32_t slot) noexcept;
  [[nodiscard]] bool holds(std::uint32_t block, std::uint32_t at, const Triangle& triangle,
                           std::uint32_t slot) const noexcept;
  void move(std::uint32_t from, std::uint32_t last, std::uint32_t to, std::uint32_t hole) noexcept;
  [[nodiscard]] std::uint32_t slot_of(std::uint32_t entry) const noexcept {
    const Entry& stored = entries_[entry];
    const std::uint32_t high =
        blocks_[entry / kBlock].high_slots >> (kHighSlotBits * (entry % kBlock));
    return stored.low_slot | (stored.slot_and_dots & 1U) << 16U |
           (high & ((1U << kHighSlotBits) - 1)) << kSlotBits;
  }
  void set_slot(std::uint32_t entry, std::uint32_t slot) noexcept;
  [[nodiscard]] TriangleEntry entry_at(std::uint32_t number,
                                       const Triangle& triangle) const noexcept {
    const Entry& stored = entries_[number];
    TriangleEntry entry{
        slot_of(number), stored.heading, {stored.center_cm[0], stored.center_cm[1]}, 0};
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::int32_t difference = ((stored.slot_and_dots >> (1 + kDotBits * k)) & kLargestDot) -
                                      (triangle.dot[k] >> (8 - kDotBits));
      const bool agrees = difference <= dot_tolerance_ && difference >= -dot_tolerance_;
      entry.agreeing_dots = static_cast<std::uint8_t>(entry.agreeing_dots + (agrees ? 1 : 0));
    }
    return entry;
  }
  // One bit for every triangle of a block that equals `triangle`.
  [[nodiscard]] std::uint32_t matches(const Block& block, const Window& window,
                                      const Triangle& triangle) const noexcept;

  std::uint32_t* heads_ = nullptr;   // 0 is an empty bucket: block 0 is never used
  std::uint32_t* stored_ = nullptr;  // entries of every bucket
  Block* blocks_ = nullptr;
  Entry* entries_ = nullptr;  // `kBlock` per block
  std::uint32_t block_count_ = 0;
  std::uint32_t first_free_ = 0;   // free blocks form a chain
  std::uint32_t first_fresh_ = 1;  // blocks from here on were never used
  std::uint32_t bucket_mask_ = 0;
  std::uint32_t max_bucket_ = 1;
  std::int32_t tolerance_cm_ = 30;
  std::uint8_t code_difference_ = 24;
  std::int32_t cell_cm_ = 30;
  std::int32_t dot_tolerance_ = 255;
};

}  // namespace unimapper::place
