// A hash table of triangles with bounded buckets.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/voxel_key.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/triangles.hpp"

namespace unimapper {

/// A stored triangle that equals a query's: which place has it, and how it lies there.
struct TriangleEntry {
  std::uint32_t place;
  std::uint16_t heading;       ///< as in `Triangle`
  std::int16_t center_cm[2];   ///< likewise
  std::uint8_t agreeing_dots;  ///< how many of the three products are equal within tolerance
};

/// Maps triangles to the places that have them. A hash cell is as wide as the tolerance is on both
/// sides together, so that 8 cells hold everything within tolerance of a query. Chirality is part
/// of the key. Every bucket is a chain of blocks, and bounded.
class TriangleTable {
 public:
  void attach(Arena& arena, const LoopSearchConfig& config) noexcept;

  /// False, and nothing stored, if the bucket or the table is full. O(1).
  bool insert(const Triangle& triangle, std::uint32_t place) noexcept;

  /// Removes one entry of `place` equal to `triangle`, if there is one. O(bucket).
  void remove(const Triangle& triangle, std::uint32_t place) noexcept;

  /// Calls `visit(entry)` for every stored triangle whose sides and chirality equal those of
  /// `triangle` within the tolerance and whose columns look alike at the three vertices; it is told
  /// how many products of normals agree.
  template <typename Visitor>
  void find(const Triangle& triangle, Visitor&& visit) const noexcept {
    // Links and blocks lie scattered in memory. All chains are walked side by side, and blocks are
    // asked for well before they are compared, so that one waits for many at a time.
    struct Chain {
      std::uint64_t cell;
      std::uint32_t at;
      Window window;
    } chains[kMaxCells];
    std::uint32_t open = 0;
    for_each_cell(triangle, [&](std::uint64_t cell, const Window& window) {
      const std::uint32_t head = heads_[bucket_of(cell)];
      if (head != 0) chains[open++] = {cell, head, window};
    });
    Pending pending;
    while (open > 0) {
      for (std::uint32_t c = 0; c < open;) {
        Chain& chain = chains[c];
        const Link& link = links_[chain.at];
        if (link.cell == chain.cell) {
          if (pending.count == Pending::kCapacity) compare(pending, triangle, visit);
          ask_for(chain.at);
          pending.block[pending.count] = chain.at;
          pending.window[pending.count++] = chain.window;
        }
        chain.at = link.next;
        if (chain.at == 0) {
          chain = chains[--open];
        } else {
          ++c;
        }
      }
    }
    compare(pending, triangle, visit);
  }

  /// How many entries `find` would compare, at least: what a query's triangle costs and how common
  /// its shape is. At most 8 x `max_bucket`.
  [[nodiscard]] std::uint32_t crowd(const Triangle& triangle) const noexcept {
    std::uint32_t count = 0;
    for_each_cell(triangle,
                  [&](std::uint64_t cell, const Window&) { count += stored_[bucket_of(cell)]; });
    return count;
  }

  /// Bytes that one stored triangle takes.
  static constexpr std::size_t entry_bytes() noexcept {
    return sizeof(Entry) + sizeof(Keys) / kBlock;
  }

 private:
  static constexpr std::uint32_t kBlock = 16;
  static constexpr std::uint32_t kMaxCells = 8;  // that the tolerance around a triangle touches
  // What decides whether a stored triangle equals a query, of 16 triangles of one cell and
  // attribute by attribute: one vector instruction compares one attribute of all.
  struct Keys {
    std::uint8_t side_cm[3][kBlock];  // above the lower end of the cell
    std::uint8_t sketch[3][kBlock];
    std::uint32_t entry[kBlock];
  };
  // What is asked of those that do. An unused one names the next unused one as its place.
  struct Entry {
    std::uint32_t place;
    std::uint16_t heading;
    std::int16_t center_cm[2];
    std::uint8_t dot[3];
    std::uint8_t reserved;
  };
  // What is needed to walk a chain of blocks.
  struct Link {
    std::uint64_t cell;
    std::uint32_t next;   // 0 ends the chain
    std::uint32_t count;  // triangles in the block
  };
  // Which offsets within a cell are within tolerance of a query.
  struct Window {
    std::uint8_t low[3];
    std::uint8_t span[3];
  };

  // Blocks to be compared.
  struct Pending {
    static constexpr std::uint32_t kCapacity = 128;
    std::uint32_t count = 0;
    std::uint32_t block[kCapacity];
    Window window[kCapacity];
  };
  void ask_for(std::uint32_t block) const noexcept {
    __builtin_prefetch(keys_[block].side_cm);
    __builtin_prefetch(keys_[block].sketch[2] + kBlock - 1);
  }
  template <typename Visitor>
  void compare(Pending& pending, const Triangle& triangle, Visitor&& visit) const noexcept {
    for (std::uint32_t k = 0; k < pending.count; ++k) {
      const std::uint32_t at = pending.block[k];
      std::uint32_t hits = matches(keys_[at], links_[at].count, pending.window[k], triangle);
      for (; hits != 0; hits &= hits - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(hits));
        visit(entry_at(entries_[keys_[at].entry[i]], triangle));
      }
    }
    pending.count = 0;
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
  std::uint32_t take_entry() noexcept;
  void put(std::uint32_t block, std::uint32_t at, std::uint32_t entry, const Triangle& triangle,
           std::uint32_t place) noexcept;
  [[nodiscard]] bool holds(std::uint32_t block, std::uint32_t at, const Triangle& triangle,
                           std::uint32_t place) const noexcept;
  void move(std::uint32_t from, std::uint32_t last, std::uint32_t to, std::uint32_t hole) noexcept;
  [[nodiscard]] TriangleEntry entry_at(const Entry& stored,
                                       const Triangle& triangle) const noexcept {
    TriangleEntry entry{
        stored.place, stored.heading, {stored.center_cm[0], stored.center_cm[1]}, 0};
    for (int k = 0; k < 3; ++k) {
      const std::int32_t difference = stored.dot[k] - triangle.dot[k];
      const bool agrees = difference <= dot_tolerance_ && difference >= -dot_tolerance_;
      entry.agreeing_dots = static_cast<std::uint8_t>(entry.agreeing_dots + (agrees ? 1 : 0));
    }
    return entry;
  }
  // One bit for every one of the `count` triangles of a block that equals `triangle`.
  [[nodiscard]] std::uint32_t matches(const Keys& keys, std::uint32_t count, const Window& window,
                                      const Triangle& triangle) const noexcept;

  std::uint32_t* heads_ = nullptr;   // 0 is an empty bucket: block 0 is never used
  std::uint32_t* stored_ = nullptr;  // entries of every bucket
  Link* links_ = nullptr;            // one per block
  Keys* keys_ = nullptr;             // likewise
  Entry* entries_ = nullptr;         // one per triangle
  std::uint32_t entry_count_ = 0;
  std::uint32_t free_entry_ = 0;   // unused ones form a chain, 0 ends it: entry 0 is never used
  std::uint32_t fresh_entry_ = 1;  // entries from here on were never used
  std::uint32_t block_count_ = 0;
  std::uint32_t first_free_ = 0;   // free blocks form a chain
  std::uint32_t first_fresh_ = 1;  // blocks from here on were never used
  std::uint32_t bucket_mask_ = 0;
  std::uint32_t max_bucket_ = 1;
  std::int32_t tolerance_cm_ = 30;
  std::int32_t cell_cm_ = 30;
  std::int32_t dot_tolerance_ = 255;
  std::uint8_t sketch_tolerance_ = 24;
};

}  // namespace unimapper
