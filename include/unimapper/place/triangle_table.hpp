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

/// A stored triangle that equals a query's: which place has it, and which keypoints it joins.
struct TriangleEntry {
  std::uint16_t place;
  std::uint8_t vertex[3];
  std::uint8_t heading;
  std::uint8_t agreeing_dots;  ///< how many of the three products are equal within tolerance
};

/// Maps triangles to the places that have them. A hash cell spans the side tolerance in each of
/// the three sides, so 27 cells hold everything within tolerance of a query. Chirality is part of
/// the key. Every bucket is a chain of blocks of bounded length, and a block holds its entries
/// attribute by attribute, so that one comparison serves many entries.
class TriangleTable {
 public:
  void attach(Arena& arena, const LoopSearchConfig& config) noexcept;

  /// False, and nothing stored, if the bucket or the table is full. O(1).
  bool insert(const Triangle& triangle, std::uint16_t place) noexcept;

  /// Removes one entry of `place` equal to `triangle`, if there is one. O(bucket).
  void remove(const Triangle& triangle, std::uint16_t place) noexcept;

  /// Calls `visit(entry)` for every stored triangle whose sides and chirality equal those of
  /// `triangle` within the tolerance, and how many products do. Returns how many entries were
  /// read, at most 27 x `max_bucket`.
  template <typename Visitor>
  std::uint32_t find(const Triangle& triangle, Visitor&& visit) const noexcept {
    std::uint32_t read = 0;
    if (block_count_ == 0) return read;
    std::int32_t low[3];
    std::int32_t high[3];
    for (int i = 0; i < 3; ++i) {
      low[i] = std::max(0, triangle.side_cm[i] - tolerance_cm_) / cell_cm_;
      high[i] = (triangle.side_cm[i] + tolerance_cm_) / cell_cm_;
    }
    for (std::int32_t a = low[0]; a <= high[0]; ++a) {
      for (std::int32_t b = std::max(a, low[1]); b <= high[1]; ++b) {
        // Cells whose sides do not ascend or do not close hold nothing.
        for (std::int32_t c = std::max(b, low[2]); c <= std::min(high[2], a + b + 1); ++c) {
          const std::uint64_t cell = cell_key(a, b, c, triangle.left_handed);
          for (std::uint32_t at = heads_[bucket_of(cell)]; at != 0; at = links_[at].next) {
            if (links_[at].cell != cell) continue;
            const Block& block = blocks_[at];
            read += links_[at].count;
            std::uint32_t hits = matches(block, links_[at].count, triangle);
            for (; hits != 0; hits &= hits - 1) {
              visit(entry_at(block, static_cast<std::uint32_t>(std::countr_zero(hits)), triangle));
            }
          }
        }
      }
    }
    return read;
  }

 private:
  // Entries of one cell, attribute by attribute.
  struct Block {
    static constexpr std::uint32_t kEntries = 32;
    std::uint16_t side_cm[3][kEntries];
    std::uint16_t place[kEntries];
    std::uint8_t dot[3][kEntries];
    std::uint8_t vertex[3][kEntries];
    std::uint8_t heading[kEntries];
  };
  // What is needed to walk a chain, apart from the blocks so that walking stays in the cache.
  struct Link {
    std::uint64_t cell;
    std::uint32_t next;   // 0 ends the chain
    std::uint32_t count;  // entries used
  };

  static std::uint64_t cell_key(std::int32_t a, std::int32_t b, std::int32_t c,
                                std::uint32_t left_handed) noexcept {
    return (static_cast<std::uint64_t>(a) << 42U) | (static_cast<std::uint64_t>(b) << 22U) |
           (static_cast<std::uint64_t>(c) << 2U) | left_handed;
  }
  [[nodiscard]] std::uint64_t cell_of(const Triangle& triangle) const noexcept {
    return cell_key(triangle.side_cm[0] / cell_cm_, triangle.side_cm[1] / cell_cm_,
                    triangle.side_cm[2] / cell_cm_, triangle.left_handed);
  }
  [[nodiscard]] std::uint32_t bucket_of(std::uint64_t cell) const noexcept {
    return static_cast<std::uint32_t>(mix_bits(cell)) & bucket_mask_;
  }
  static void take_out(Block& block, std::uint32_t hole, std::uint32_t last) noexcept;
  [[nodiscard]] TriangleEntry entry_at(const Block& block, std::uint32_t i,
                                       const Triangle& triangle) const noexcept {
    TriangleEntry entry{block.place[i],
                        {block.vertex[0][i], block.vertex[1][i], block.vertex[2][i]},
                        block.heading[i],
                        0};
    for (int k = 0; k < 3; ++k) {
      const std::int32_t difference = block.dot[k][i] - triangle.dot[k];
      const bool agrees = difference <= dot_tolerance_ && difference >= -dot_tolerance_;
      entry.agreeing_dots = static_cast<std::uint8_t>(entry.agreeing_dots + (agrees ? 1 : 0));
    }
    return entry;
  }
  // One bit for every one of the `count` entries that equals `triangle`.
  [[nodiscard]] std::uint32_t matches(const Block& block, std::uint32_t count,
                                      const Triangle& triangle) const noexcept;

  std::uint32_t* heads_ = nullptr;  // 0 is an empty bucket: block 0 is never used
  Link* links_ = nullptr;           // one per block
  Block* blocks_ = nullptr;
  std::uint32_t block_count_ = 0;
  std::uint32_t first_free_ = 0;   // free blocks form a chain
  std::uint32_t first_fresh_ = 1;  // blocks from here on were never used
  std::uint32_t bucket_mask_ = 0;
  std::uint32_t max_bucket_ = 1;
  std::int32_t tolerance_cm_ = 30;
  std::int32_t cell_cm_ = 30;
  std::int32_t dot_tolerance_ = 255;
};

}  // namespace unimapper
