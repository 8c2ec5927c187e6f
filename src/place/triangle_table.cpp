#include "unimapper/place/triangle_table.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace unimapper {
namespace {

// Chains end with a partly filled block: room for that.
constexpr std::size_t kSlackPercent = 140;

}  // namespace

void TriangleTable::attach(Arena& arena, const LoopSearchConfig& config) noexcept {
  const std::size_t triangles =
      static_cast<std::size_t>(config.max_places) * config.triangles.max_triangles;
  const std::size_t blocks = triangles * kSlackPercent / 100 / Block::kEntries + 1024;
  const std::size_t buckets =
      std::bit_ceil(std::clamp<std::size_t>(triangles / 8, 1024, 1U << 18U));
  heads_ = arena.allocate<std::uint32_t>(buckets);
  blocks_ = arena.allocate<Block>(blocks);
  const bool ready = heads_ != nullptr && blocks_ != nullptr;
  block_count_ = ready ? static_cast<std::uint32_t>(blocks) : 0;
  bucket_mask_ = static_cast<std::uint32_t>(buckets - 1);
  first_free_ = 0;
  first_fresh_ = 1;
  max_chain_ = std::max(1U, config.max_bucket / Block::kEntries);
  tolerance_cm_ = std::max(1, static_cast<std::int32_t>(config.side_tolerance_m * 100.0F + 0.5F));
  cell_cm_ = 2 * tolerance_cm_;
  dot_tolerance_ = static_cast<std::int32_t>(config.dot_tolerance * 255.0F + 0.5F);
}

bool TriangleTable::insert(const Triangle& triangle, std::uint16_t place) noexcept {
  if (block_count_ == 0) return false;
  const std::uint32_t bucket = bucket_of(triangle);
  std::uint32_t head = heads_[bucket];
  if (head == 0 || blocks_[head].count == Block::kEntries) {
    const std::uint32_t chain = head == 0 ? 0 : blocks_[head].chain;
    if (chain >= max_chain_) return false;
    std::uint32_t fresh = first_free_;
    if (fresh != 0) {
      first_free_ = blocks_[fresh].next;
    } else if (first_fresh_ < block_count_) {
      fresh = first_fresh_++;
    } else {
      return false;
    }
    blocks_[fresh].next = head;
    blocks_[fresh].count = 0;
    blocks_[fresh].chain = chain + 1;
    heads_[bucket] = head = fresh;
  }
  Block& block = blocks_[head];
  TriangleEntry& entry = block.entry[block.count++];
  for (int i = 0; i < 3; ++i) {
    entry.side_cm[i] = triangle.side_cm[i];
    entry.vertex[i] = triangle.vertex[i];
    entry.dot[i] = triangle.dot[i];
  }
  entry.place = place;
  entry.left_handed = triangle.left_handed;
  return true;
}

void TriangleTable::remove(const Triangle& triangle, std::uint16_t place) noexcept {
  if (block_count_ == 0) return;
  const std::uint32_t bucket = bucket_of(triangle);
  const std::uint32_t head = heads_[bucket];
  const auto is_it = [&](const TriangleEntry& entry) {
    return entry.place == place && std::equal(entry.vertex, entry.vertex + 3, triangle.vertex) &&
           std::equal(entry.side_cm, entry.side_cm + 3, triangle.side_cm);
  };
  for (std::uint32_t at = head; at != 0; at = blocks_[at].next) {
    for (std::uint32_t i = 0; i < blocks_[at].count; ++i) {
      if (!is_it(blocks_[at].entry[i])) continue;
      // The newest entry fills the hole; a block that runs empty goes back to the free ones.
      blocks_[at].entry[i] = blocks_[head].entry[--blocks_[head].count];
      if (blocks_[head].count == 0) {
        heads_[bucket] = blocks_[head].next;
        blocks_[head].next = first_free_;
        first_free_ = head;
      }
      return;
    }
  }
}

}  // namespace unimapper
