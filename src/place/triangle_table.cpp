#include "unimapper/place/triangle_table.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

namespace unimapper {
namespace {

// The newest block of every cell is partly filled: room for that.
constexpr std::size_t kSpareBlocks = 3U << 14U;

// Number of set bits, in the few steps that a vector unit does for many bytes at once.
constexpr std::uint8_t count_ones(std::uint8_t bits) noexcept {
  const auto pairs = static_cast<std::uint8_t>(bits - ((bits >> 1U) & 0x55U));
  const auto quads = static_cast<std::uint8_t>((pairs & 0x33U) + ((pairs >> 2U) & 0x33U));
  return static_cast<std::uint8_t>((quads + (quads >> 4U)) & 0x0FU);
}

}  // namespace

void TriangleTable::attach(Arena& arena, const LoopSearchConfig& config) noexcept {
  const std::size_t triangles =
      static_cast<std::size_t>(config.max_places) * config.triangles.max_triangles;
  // Few triangles cannot start more blocks than there are triangles.
  const std::size_t blocks = 1 + triangles / kBlock + std::min(triangles, kSpareBlocks);
  const std::size_t buckets =
      std::bit_ceil(std::clamp<std::size_t>(triangles / 8, 1024, 1U << 18U));
  heads_ = arena.allocate<std::uint32_t>(buckets);
  stored_ = arena.allocate<std::uint32_t>(buckets);
  links_ = arena.allocate<Link>(blocks);
  keys_ = arena.allocate<Keys>(blocks);
  entries_ = arena.allocate<Entry>(triangles + 1);
  const bool ready = heads_ != nullptr && stored_ != nullptr && links_ != nullptr &&
                     keys_ != nullptr && entries_ != nullptr;
  block_count_ = ready ? static_cast<std::uint32_t>(blocks) : 0;
  bucket_mask_ = static_cast<std::uint32_t>(buckets - 1);
  first_free_ = 0;
  first_fresh_ = 1;
  entry_count_ = static_cast<std::uint32_t>(triangles + 1);
  free_entry_ = 0;
  fresh_entry_ = 1;
  max_bucket_ = std::max(1U, config.max_bucket);
  tolerance_cm_ = std::max(1, static_cast<std::int32_t>(config.side_tolerance_m * 100.0F + 0.5F));
  cell_cm_ = 2 * tolerance_cm_ + 1;
  dot_tolerance_ = static_cast<std::int32_t>(config.dot_tolerance * 255.0F + 0.5F);
  sketch_tolerance_ = static_cast<std::uint8_t>(std::min(24U, config.max_code_difference));
}

bool TriangleTable::insert(const Triangle& triangle, std::uint32_t place) noexcept {
  if (block_count_ == 0) return false;
  const std::uint64_t cell = cell_of(triangle);
  const std::uint32_t bucket = bucket_of(cell);
  if (stored_[bucket] >= max_bucket_) return false;
  const bool has_entry = free_entry_ != 0 || fresh_entry_ < entry_count_;
  if (!has_entry) return false;
  // A cell's newest block comes first in its chain, so the first one met is the one with room.
  std::uint32_t with_room = heads_[bucket];
  while (with_room != 0 && links_[with_room].cell != cell) with_room = links_[with_room].next;
  if (with_room == 0 || links_[with_room].count == kBlock) {
    std::uint32_t fresh = first_free_;
    if (fresh != 0) {
      first_free_ = links_[fresh].next;
    } else if (first_fresh_ < block_count_) {
      fresh = first_fresh_++;
    } else {
      return false;
    }
    links_[fresh] = {cell, heads_[bucket], 0};
    heads_[bucket] = with_room = fresh;
  }
  put(with_room, links_[with_room].count++, take_entry(), triangle, place);
  ++stored_[bucket];
  return true;
}

std::uint32_t TriangleTable::take_entry() noexcept {
  if (free_entry_ == 0) return fresh_entry_++;
  const std::uint32_t entry = free_entry_;
  free_entry_ = entries_[entry].place;
  return entry;
}

void TriangleTable::put(std::uint32_t block, std::uint32_t at, std::uint32_t index,
                        const Triangle& triangle, std::uint32_t place) noexcept {
  Entry& entry = entries_[index];
  keys_[block].entry[at] = index;
  for (int i = 0; i < 3; ++i) {
    keys_[block].side_cm[i][at] = static_cast<std::uint8_t>(triangle.side_cm[i] % cell_cm_);
    keys_[block].sketch[i][at] = triangle.sketch[i];
    entry.dot[i] = triangle.dot[i];
  }
  entry.place = place;
  entry.heading = triangle.heading;
  entry.center_cm[0] = triangle.center_cm[0];
  entry.center_cm[1] = triangle.center_cm[1];
}

bool TriangleTable::holds(std::uint32_t block, std::uint32_t at, const Triangle& triangle,
                          std::uint32_t place) const noexcept {
  const Entry& entry = entries_[keys_[block].entry[at]];
  bool same = entry.place == place && entry.heading == triangle.heading &&
              entry.center_cm[0] == triangle.center_cm[0] &&
              entry.center_cm[1] == triangle.center_cm[1];
  for (int k = 0; k < 3; ++k) {
    same = same && keys_[block].side_cm[k][at] == triangle.side_cm[k] % cell_cm_;
  }
  return same;
}

void TriangleTable::remove(const Triangle& triangle, std::uint32_t place) noexcept {
  if (block_count_ == 0) return;
  const std::uint64_t cell = cell_of(triangle);
  const std::uint32_t bucket = bucket_of(cell);
  // Holes are filled from the cell's first block: the one that may have room stays the first.
  std::uint32_t newest = 0;
  std::uint32_t before_newest = 0;
  std::uint32_t before = 0;
  for (std::uint32_t at = heads_[bucket]; at != 0; before = at, at = links_[at].next) {
    if (links_[at].cell != cell) continue;
    if (newest == 0) {
      newest = at;
      before_newest = before;
    }
    for (std::uint32_t i = 0; i < links_[at].count; ++i) {
      if (!holds(at, i, triangle, place)) continue;
      const std::uint32_t unused = keys_[at].entry[i];
      entries_[unused].place = free_entry_;
      free_entry_ = unused;
      move(newest, --links_[newest].count, at, i);
      --stored_[bucket];
      if (links_[newest].count > 0) return;
      (before_newest == 0 ? heads_[bucket] : links_[before_newest].next) = links_[newest].next;
      links_[newest].next = first_free_;
      first_free_ = newest;
      return;
    }
  }
}

void TriangleTable::move(std::uint32_t from, std::uint32_t last, std::uint32_t to,
                         std::uint32_t hole) noexcept {
  for (int k = 0; k < 3; ++k) {
    keys_[to].side_cm[k][hole] = keys_[from].side_cm[k][last];
    keys_[to].sketch[k][hole] = keys_[from].sketch[k][last];
  }
  keys_[to].entry[hole] = keys_[from].entry[last];
}

std::uint32_t TriangleTable::matches(const Keys& keys, std::uint32_t count, const Window& window,
                                     const Triangle& triangle) const noexcept {
  // Triangles beyond the count are compared as well and masked out at the end: loops of constant
  // length over bytes, without branches, are what compilers turn into vector instructions.
  std::uint8_t differs[kBlock] = {};
  for (int k = 0; k < 3; ++k) {
    for (std::uint32_t i = 0; i < kBlock; ++i) {
      const auto above = static_cast<std::uint8_t>(keys.side_cm[k][i] - window.low[k]);
      differs[i] = static_cast<std::uint8_t>(differs[i] | (above > window.span[k] ? 0xFFU : 0U));
    }
  }
  std::uint8_t apart[kBlock] = {};
  for (int k = 0; k < 3; ++k) {
    for (std::uint32_t i = 0; i < kBlock; ++i) {
      const auto bits = static_cast<std::uint8_t>(keys.sketch[k][i] ^ triangle.sketch[k]);
      apart[i] = static_cast<std::uint8_t>(apart[i] + count_ones(bits));
    }
  }
  for (std::uint32_t i = 0; i < kBlock; ++i) {
    differs[i] =
        static_cast<std::uint8_t>(differs[i] | (apart[i] > sketch_tolerance_ ? 0xFFU : 0U));
  }
  // Most blocks hold nothing: seen from two words at once.
  std::uint64_t words[kBlock / 8];
  std::memcpy(words, differs, sizeof words);
  if ((words[0] & words[1]) == ~0ULL) return 0;
  std::uint32_t hits = 0;
  for (std::uint32_t i = 0; i < count; ++i) hits |= (differs[i] == 0 ? 1U : 0U) << i;
  return hits;
}

}  // namespace unimapper
