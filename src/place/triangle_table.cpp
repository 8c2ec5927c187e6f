#include "unimapper/place/triangle_table.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace unimapper {
namespace {

// The newest block of every cell is partly filled: room for that.
constexpr std::size_t kSpareBlocks = 16384;

}  // namespace

void TriangleTable::attach(Arena& arena, const LoopSearchConfig& config) noexcept {
  const std::size_t triangles =
      static_cast<std::size_t>(config.max_places) * config.triangles.max_triangles;
  // Few triangles cannot start more blocks than there are triangles.
  const std::size_t blocks = 1 + triangles / Block::kEntries + std::min(triangles, kSpareBlocks);
  const std::size_t buckets =
      std::bit_ceil(std::clamp<std::size_t>(triangles / 8, 1024, 1U << 18U));
  heads_ = arena.allocate<std::uint32_t>(buckets);
  links_ = arena.allocate<Link>(blocks);
  blocks_ = arena.allocate<Block>(blocks);
  const bool ready = heads_ != nullptr && links_ != nullptr && blocks_ != nullptr;
  block_count_ = ready ? static_cast<std::uint32_t>(blocks) : 0;
  bucket_mask_ = static_cast<std::uint32_t>(buckets - 1);
  first_free_ = 0;
  first_fresh_ = 1;
  max_bucket_ = std::max(1U, config.max_bucket);
  tolerance_cm_ = std::max(1, static_cast<std::int32_t>(config.side_tolerance_m * 100.0F + 0.5F));
  cell_cm_ = tolerance_cm_;
  dot_tolerance_ = static_cast<std::int32_t>(config.dot_tolerance * 255.0F + 0.5F);
}

bool TriangleTable::insert(const Triangle& triangle, std::uint16_t place) noexcept {
  if (block_count_ == 0) return false;
  const std::uint64_t cell = cell_of(triangle);
  const std::uint32_t bucket = bucket_of(cell);
  // Blocks of a cell with room come before its full ones.
  std::uint32_t stored = 0;
  std::uint32_t with_room = 0;
  for (std::uint32_t at = heads_[bucket]; at != 0; at = links_[at].next) {
    stored += links_[at].count;
    const bool has_room = links_[at].cell == cell && links_[at].count < Block::kEntries;
    if (has_room && with_room == 0) with_room = at;
  }
  if (stored >= max_bucket_) return false;
  if (with_room == 0) {
    std::uint32_t fresh = first_free_;
    if (fresh != 0) {
      first_free_ = links_[fresh].next;
    } else if (first_fresh_ < block_count_) {
      fresh = first_fresh_++;
    } else {
      return false;
    }
    links_[fresh].cell = cell;
    links_[fresh].count = 0;
    links_[fresh].next = heads_[bucket];
    heads_[bucket] = with_room = fresh;
  }
  Block& block = blocks_[with_room];
  const std::uint32_t at = links_[with_room].count++;
  for (int i = 0; i < 3; ++i) {
    block.side_cm[i][at] = triangle.side_cm[i];
    block.dot[i][at] = triangle.dot[i];
    block.vertex[i][at] = triangle.vertex[i];
  }
  block.place[at] = place;
  block.heading[at] = triangle.heading;
  return true;
}

void TriangleTable::remove(const Triangle& triangle, std::uint16_t place) noexcept {
  if (block_count_ == 0) return;
  const std::uint64_t cell = cell_of(triangle);
  const std::uint32_t bucket = bucket_of(cell);
  std::uint32_t before = 0;
  for (std::uint32_t at = heads_[bucket]; at != 0; before = at, at = links_[at].next) {
    Block& block = blocks_[at];
    Link& link = links_[at];
    if (link.cell != cell) continue;
    for (std::uint32_t i = 0; i < link.count; ++i) {
      bool same = block.place[i] == place;
      for (int k = 0; k < 3; ++k) same = same && block.vertex[k][i] == triangle.vertex[k];
      if (!same) continue;
      take_out(block, i, --link.count);
      if (link.count > 0) return;
      (before == 0 ? heads_[bucket] : links_[before].next) = link.next;
      link.next = first_free_;
      first_free_ = at;
      return;
    }
  }
}

// The last entry fills the hole.
void TriangleTable::take_out(Block& block, std::uint32_t hole, std::uint32_t last) noexcept {
  for (int k = 0; k < 3; ++k) {
    block.side_cm[k][hole] = block.side_cm[k][last];
    block.dot[k][hole] = block.dot[k][last];
    block.vertex[k][hole] = block.vertex[k][last];
  }
  block.place[hole] = block.place[last];
  block.heading[hole] = block.heading[last];
}

std::uint32_t TriangleTable::matches(const Block& block, std::uint32_t count,
                                     const Triangle& triangle) const noexcept {
  // Entries beyond the count are compared as well and masked out at the end: a loop of constant
  // length without branches is what compilers turn into vector instructions.
  std::uint16_t differs[Block::kEntries] = {};
  for (int k = 0; k < 3; ++k) {
    const auto low = static_cast<std::uint16_t>(std::max(0, triangle.side_cm[k] - tolerance_cm_));
    const auto span = static_cast<std::uint16_t>(triangle.side_cm[k] + tolerance_cm_ - low);
    for (std::uint32_t i = 0; i < Block::kEntries; ++i) {
      const auto above = static_cast<std::uint16_t>(block.side_cm[k][i] - low);
      differs[i] = static_cast<std::uint16_t>(differs[i] | (above > span ? 1U : 0U));
    }
  }
  std::uint32_t hits = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    hits |= (differs[i] == 0 ? 1U : 0U) << i;
  }
  return hits;
}

}  // namespace unimapper
