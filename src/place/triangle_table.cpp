#include "triangle_table.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

namespace unimapper::place {
namespace {

// With more triangles than these, cells are as wide as the tolerance is on one side: up to 27 then
// hold what 8 did, with less than half as many out of tolerance. With few, visiting more cells
// costs more than it saves.
constexpr std::size_t kManyTriangles = 1U << 22U;

// An entry's number has 32 bits.
constexpr std::size_t kMostBlocks = std::size_t{1} << 29U;

// A register of bytes, on every processor that has such (compilers split them elsewhere). A block
// fills the lower half: the next narrower vectors are slower.
using Bytes = std::uint8_t __attribute__((vector_size(16)));

template <std::size_t kCount>
Bytes load(const std::uint8_t (&from)[kCount]) noexcept {
  Bytes bytes = {};
  std::memcpy(&bytes, from, kCount);
  return bytes;
}

// Number of set bits of every byte.
Bytes count_ones(Bytes bits) noexcept {
  const Bytes pairs = bits - ((bits >> 1) & 0x55);
  const Bytes quads = (pairs & 0x33) + ((pairs >> 2) & 0x33);
  return (quads + (quads >> 4)) & 0x0F;
}

// One bit for every byte of the lower half that is not zero where `bytes` holds 0 and 255 only.
std::uint32_t one_bit_each(Bytes bytes) noexcept {
  std::uint64_t word;
  std::memcpy(&word, &bytes, sizeof word);
  return static_cast<std::uint32_t>((word & 0x8040201008040201ULL) * 0x0101010101010101ULL >> 56U);
}

// The newest block of every cell is partly filled: room for that. Of few triangles most have a cell
// of their own; of many, common cells take most.
std::size_t spare_blocks(std::size_t triangles) noexcept {
  constexpr std::size_t kSpare = 3U << 14U;
  if (triangles > kManyTriangles) return 12 * kSpare;
  return std::min({triangles, (1U << 14U) + triangles / 16, kSpare});
}

}  // namespace

void TriangleTable::allocate(Arena& arena, const LoopSearchConfig& config) noexcept {
  const std::size_t triangles =
      static_cast<std::size_t>(config.max_places) * config.triangles.max_triangles;
  const bool many = triangles > kManyTriangles;
  const std::size_t blocks =
      std::min(1 + triangles / kBlock + spare_blocks(triangles), kMostBlocks);
  const std::size_t buckets =
      std::bit_ceil(std::clamp<std::size_t>(triangles / 8, 1024, 1U << 20U));
  heads_ = arena.allocate<std::uint32_t>(buckets);
  stored_ = arena.allocate<std::uint32_t>(buckets);
  blocks_ = arena.allocate<Block>(blocks);
  entries_ = arena.allocate<Entry>(blocks * kBlock);
  const bool ready =
      heads_ != nullptr && stored_ != nullptr && blocks_ != nullptr && entries_ != nullptr;
  block_count_ = ready ? static_cast<std::uint32_t>(blocks) : 0;
  bucket_mask_ = static_cast<std::uint32_t>(buckets - 1);
  first_free_ = 0;
  first_fresh_ = 1;
  max_bucket_ = std::max(1U, config.max_bucket);
  tolerance_cm_ = std::max(1, static_cast<std::int32_t>(config.side_tolerance_m * 100.0F + 0.5F));
  code_difference_ = static_cast<std::uint8_t>(std::min(24U, config.max_code_difference));
  cell_cm_ = many ? tolerance_cm_ + 1 : 2 * tolerance_cm_ + 1;
  dot_tolerance_ = static_cast<std::int32_t>(
      LoopSearchConfig::kDotTolerance * static_cast<float>(kLargestDot) + 0.5F);
}

bool TriangleTable::insert(const Triangle& triangle, std::uint32_t slot) noexcept {
  if (block_count_ == 0) return false;
  const std::uint64_t cell = cell_of(triangle);
  const std::uint32_t bucket = bucket_of(cell);
  if (stored_[bucket] >= max_bucket_) return false;
  // A cell's newest pair of blocks comes first in its chain, so the first one visited is the one
  // with room.
  std::uint32_t with_room = heads_[bucket];
  while (with_room != 0 && blocks_[with_room].cell != cell) with_room = blocks_[with_room].next;
  const bool is_paired = with_room != 0 && blocks_[with_room].has_second != 0;
  if (with_room != 0) with_room = latest(with_room);
  if (with_room == 0 || blocks_[with_room].count == kBlock) {
    std::uint32_t& link = with_room == 0 || is_paired ? heads_[bucket] : blocks_[with_room].next;
    const std::uint32_t fresh = take_block(cell, link);
    if (fresh == 0) return false;
    link = fresh;
    if (&link != &heads_[bucket]) blocks_[with_room].has_second = 1;
    with_room = fresh;
  }
  store(with_room, blocks_[with_room].count++, triangle, slot);
  ++stored_[bucket];
  return true;
}

std::uint32_t TriangleTable::take_block(std::uint64_t cell, std::uint32_t next) noexcept {
  std::uint32_t fresh = first_free_;
  if (fresh != 0) {
    first_free_ = blocks_[fresh].next;
  } else if (first_fresh_ < block_count_) {
    fresh = first_fresh_++;
  } else {
    return 0;
  }
  Block& block = blocks_[fresh];
  block.cell = cell;
  block.next = next;
  block.count = 0;
  block.has_second = 0;
  return fresh;
}

void TriangleTable::store(std::uint32_t block, std::uint32_t at, const Triangle& triangle,
                          std::uint32_t slot) noexcept {
  Entry& entry = entries_[block * kBlock + at];
  for (int i = 0; i < 3; ++i) {
    blocks_[block].side_cm[i][at] = static_cast<std::uint8_t>(triangle.side_cm[i] % cell_cm_);
    blocks_[block].sketch[i][at] = triangle.sketch[i];
  }
  entry.slot_and_dots = 0;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t dot = triangle.dot[k] >> (8 - kDotBits);
    entry.slot_and_dots =
        static_cast<std::uint16_t>(entry.slot_and_dots | dot << (1 + kDotBits * k));
  }
  set_slot(block * kBlock + at, slot);
  entry.heading = triangle.heading;
  entry.center_cm[0] = triangle.center_cm[0];
  entry.center_cm[1] = triangle.center_cm[1];
}

void TriangleTable::set_slot(std::uint32_t entry, std::uint32_t slot) noexcept {
  Entry& stored = entries_[entry];
  stored.low_slot = static_cast<std::uint16_t>(slot);
  stored.slot_and_dots =
      static_cast<std::uint16_t>((stored.slot_and_dots & ~1U) | (slot >> 16U & 1U));
  Block& block = blocks_[entry / kBlock];
  const std::uint32_t shift = kHighSlotBits * (entry % kBlock);
  const std::uint32_t others = ~(((1U << kHighSlotBits) - 1) << shift);
  constexpr std::uint32_t kAll = (1U << (kHighSlotBits * kBlock)) - 1;
  block.high_slots = ((block.high_slots & others) | (slot >> kSlotBits) << shift) & kAll;
}

bool TriangleTable::holds(std::uint32_t block, std::uint32_t at, const Triangle& triangle,
                          std::uint32_t slot) const noexcept {
  const Entry& entry = entries_[block * kBlock + at];
  bool same = slot_of(block * kBlock + at) == slot && entry.heading == triangle.heading &&
              entry.center_cm[0] == triangle.center_cm[0] &&
              entry.center_cm[1] == triangle.center_cm[1];
  for (int k = 0; k < 3; ++k) {
    same = same && blocks_[block].side_cm[k][at] == triangle.side_cm[k] % cell_cm_;
  }
  return same;
}

void TriangleTable::remove(const Triangle& triangle, std::uint32_t slot) noexcept {
  if (block_count_ == 0) return;
  const std::uint64_t cell = cell_of(triangle);
  const std::uint32_t bucket = bucket_of(cell);
  // Holes are filled from the cell's first pair of blocks: the one that may have room stays the
  // first.
  std::uint32_t newest = 0;
  std::uint32_t before_newest = 0;
  std::uint32_t before = 0;
  for (std::uint32_t at = heads_[bucket]; at != 0; before = at, at = blocks_[at].next) {
    if (blocks_[at].cell != cell) continue;
    if (newest == 0) {
      newest = at;
      before_newest = before;
    }
    for (std::uint32_t i = 0; i < blocks_[at].count; ++i) {
      if (!holds(at, i, triangle, slot)) continue;
      const std::uint32_t from = latest(newest);
      if (from != newest) before_newest = newest;
      move(from, --blocks_[from].count, at, i);
      --stored_[bucket];
      if (blocks_[from].count > 0) return;
      blocks_[newest].has_second = 0;
      (before_newest == 0 ? heads_[bucket] : blocks_[before_newest].next) = blocks_[from].next;
      blocks_[from].next = first_free_;
      first_free_ = from;
      return;
    }
  }
}

void TriangleTable::move(std::uint32_t from, std::uint32_t last, std::uint32_t to,
                         std::uint32_t hole) noexcept {
  for (int k = 0; k < 3; ++k) {
    blocks_[to].side_cm[k][hole] = blocks_[from].side_cm[k][last];
    blocks_[to].sketch[k][hole] = blocks_[from].sketch[k][last];
  }
  const std::uint32_t slot = slot_of(from * kBlock + last);
  entries_[to * kBlock + hole] = entries_[from * kBlock + last];
  set_slot(to * kBlock + hole, slot);
}

std::uint32_t TriangleTable::matches(const Block& block, const Window& window,
                                     const Triangle& triangle) const noexcept {
  // Triangles beyond the count are compared as well and masked out at the end.
  Bytes apart = {};
  for (int k = 0; k < 3; ++k) apart += count_ones(load(block.sketch[k]) ^ triangle.sketch[k]);
  auto equal = apart <= code_difference_;
  for (int k = 0; k < 3; ++k) {
    equal &= load(block.side_cm[k]) - window.low[k] <= window.span[k];
  }
  return one_bit_each(Bytes(equal)) & ((1U << block.count) - 1U);
}

}  // namespace unimapper::place
