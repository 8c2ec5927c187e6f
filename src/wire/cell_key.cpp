#include "cell_key.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace unimapper::wire {

namespace {

/// A run of bits of the key by which one pass of the sort distributes.
struct Digit {
  unsigned shift;
  unsigned bits;
  std::size_t first_count;  ///< of its histogram

  [[nodiscard]] constexpr std::size_t of(CellKey key) const noexcept {
    return static_cast<std::size_t>(key >> shift) & (values() - 1);
  }
  [[nodiscard]] constexpr std::size_t values() const noexcept { return std::size_t{1} << bits; }
};

// All 52 bits of a key; the intensity first, which counts least.
constexpr std::array<Digit, 5> kDigits{
    {{kIntensityShift, 8, 8192}, {0, 11, 0}, {11, 11, 2048}, {22, 11, 4096}, {33, 11, 6144}}};
static_assert(kDigits.front().first_count + kDigits.front().values() == CellKeyScratch::kCounts);
static_assert(kDigits.back().shift + kDigits.back().bits == kIntensityShift);

/// Turns a histogram into the index at which each value's keys begin.
void accumulate(std::span<std::uint32_t> counts) noexcept {
  std::uint32_t begin = 0;
  for (std::uint32_t& count : counts) begin += std::exchange(count, begin);
}

}  // namespace

std::optional<CellKey> cell_key(const FineCell& cell, const CellGrid& grid) noexcept {
  const std::optional<GridPosition> at = grid.find(cell.position);
  if (!at) return std::nullopt;
  CellKey key = cell.intensity;
  for (const std::int32_t index : at->cell) {
    key = (key << 8U) | static_cast<std::uint32_t>(index / kBlockCells);
  }
  for (const std::int32_t index : at->cell) {
    key = (key << 5U) | static_cast<std::uint32_t>(index % kBlockCells);
  }
  key = (key << 1U) | (cell.ground != 0 ? 0U : 1U);
  key = (key << 1U) | static_cast<std::uint32_t>(at->part[0]);
  key = (key << 1U) | static_cast<std::uint32_t>(at->part[1]);
  return (key << 2U) | static_cast<std::uint32_t>(at->part[2]);
}

std::span<const CellKey> sorted_cell_keys(std::span<const FineCell> cells, const CellGrid& grid,
                                          const CellKeyScratch& scratch,
                                          std::uint64_t& left_out) noexcept {
  std::fill_n(scratch.counts.data(), CellKeyScratch::kCounts, 0U);
  std::size_t count = 0;
  for (const FineCell& cell : cells) {
    const std::optional<CellKey> key = cell_key(cell, grid);
    if (!key || count == scratch.keys.size()) {
      ++left_out;
      continue;
    }
    scratch.keys[count++] = *key;
    for (const Digit& digit : kDigits) ++scratch.counts[digit.first_count + digit.of(*key)];
  }
  std::span<CellKey> from = scratch.keys.first(count);
  std::span<CellKey> to = scratch.spare.first(count);
  for (const Digit& digit : kDigits) {
    // Without intensities there is nothing to order by them.
    if (digit.shift == kIntensityShift && scratch.counts[digit.first_count] == count) continue;
    const std::span<std::uint32_t> begins =
        scratch.counts.subspan(digit.first_count, digit.values());
    accumulate(begins);
    for (const CellKey key : from) to[begins[digit.of(key)]++] = key;
    std::swap(from, to);
  }
  return from;
}

}  // namespace unimapper::wire
