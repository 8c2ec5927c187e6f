// A hash table of triangles with bounded buckets.
#pragma once

#include <cstdint>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/voxel_key.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/triangles.hpp"

namespace unimapper {

/// A stored triangle: 16 bytes, four to a cache line.
struct TriangleEntry {
  std::uint16_t side_cm[3];
  std::uint16_t place;
  std::uint8_t vertex[3];
  std::uint8_t dot[3];
  std::uint8_t left_handed;
  std::uint8_t reserved;
};
static_assert(sizeof(TriangleEntry) == 16);

/// Maps triangles to the places that have them. A hash cell spans twice the side tolerance in
/// each of the three sides, so at most eight cells hold everything within tolerance of a query.
/// Chirality is part of the key. Every bucket is a chain of blocks of bounded length.
class TriangleTable {
 public:
  void attach(Arena& arena, const LoopSearchConfig& config) noexcept;

  /// False, and nothing stored, if the bucket or the table is full. O(1).
  bool insert(const Triangle& triangle, std::uint16_t place) noexcept;

  /// Removes one entry of `place` equal to `triangle`, if there is one. O(bucket).
  void remove(const Triangle& triangle, std::uint16_t place) noexcept;

  /// Calls `visit(entry)` for every stored triangle whose sides, products and chirality equal
  /// those of `triangle` within the tolerances. At most 8 x `max_bucket` entries are read.
  template <typename Visitor>
  void find(const Triangle& triangle, Visitor&& visit) const noexcept {
    std::int32_t low[3];
    std::int32_t high[3];
    for (int i = 0; i < 3; ++i) {
      low[i] = (static_cast<std::int32_t>(triangle.side_cm[i]) - tolerance_cm_) / cell_cm_;
      high[i] = (static_cast<std::int32_t>(triangle.side_cm[i]) + tolerance_cm_) / cell_cm_;
    }
    for (std::int32_t a = low[0]; a <= high[0]; ++a) {
      for (std::int32_t b = low[1]; b <= high[1]; ++b) {
        for (std::int32_t c = low[2]; c <= high[2]; ++c) {
          // Cells whose sides do not ascend or do not close hold nothing.
          if (b < a || c < b || c > a + b + 1) continue;
          const std::uint32_t bucket = bucket_of(a, b, c, triangle.left_handed);
          for (std::uint32_t at = heads_[bucket]; at != 0; at = blocks_[at].next) {
            const Block& block = blocks_[at];
            for (std::uint32_t i = 0; i < block.count; ++i) {
              if (matches(block.entry[i], triangle, a, b, c)) visit(block.entry[i]);
            }
          }
        }
      }
    }
  }

 private:
  // Two cache lines.
  struct Block {
    static constexpr std::uint32_t kEntries = 7;
    TriangleEntry entry[kEntries];
    std::uint32_t next;   // 0 ends the chain
    std::uint32_t count;  // entries used; only the first block of a chain may have room
    std::uint32_t chain;  // blocks from here to the end
    std::uint32_t reserved;
  };
  static_assert(sizeof(Block) == 128);

  [[nodiscard]] std::uint32_t bucket_of(std::int32_t a, std::int32_t b, std::int32_t c,
                                        std::uint32_t left_handed) const noexcept {
    const std::uint64_t key = (static_cast<std::uint64_t>(a) << 42U) |
                              (static_cast<std::uint64_t>(b) << 22U) |
                              (static_cast<std::uint64_t>(c) << 2U) | left_handed;
    return static_cast<std::uint32_t>(mix_bits(key)) & bucket_mask_;
  }
  [[nodiscard]] std::uint32_t bucket_of(const Triangle& triangle) const noexcept {
    return bucket_of(triangle.side_cm[0] / cell_cm_, triangle.side_cm[1] / cell_cm_,
                     triangle.side_cm[2] / cell_cm_, triangle.left_handed);
  }
  // The cell is compared too, so that two cells of one bucket do not deliver an entry twice.
  [[nodiscard]] bool matches(const TriangleEntry& entry, const Triangle& triangle, std::int32_t a,
                             std::int32_t b, std::int32_t c) const noexcept {
    const std::int32_t cell[3] = {a, b, c};
    for (int i = 0; i < 3; ++i) {
      const std::int32_t difference = static_cast<std::int32_t>(entry.side_cm[i]) -
                                      static_cast<std::int32_t>(triangle.side_cm[i]);
      if (difference > tolerance_cm_ || difference < -tolerance_cm_) return false;
    }
    for (int i = 0; i < 3; ++i) {
      const std::int32_t difference =
          static_cast<std::int32_t>(entry.dot[i]) - static_cast<std::int32_t>(triangle.dot[i]);
      if (difference > dot_tolerance_ || difference < -dot_tolerance_) return false;
      if (entry.side_cm[i] / cell_cm_ != cell[i]) return false;
    }
    return entry.left_handed == triangle.left_handed;
  }

  std::uint32_t* heads_ = nullptr;  // 0 is an empty bucket: block 0 is never used
  Block* blocks_ = nullptr;
  std::uint32_t block_count_ = 0;
  std::uint32_t first_free_ = 0;   // free blocks form a chain
  std::uint32_t first_fresh_ = 1;  // blocks from here on were never used
  std::uint32_t bucket_mask_ = 0;
  std::uint32_t max_chain_ = 1;
  std::int32_t tolerance_cm_ = 30;
  std::int32_t cell_cm_ = 60;
  std::int32_t dot_tolerance_ = 255;
};

}  // namespace unimapper
