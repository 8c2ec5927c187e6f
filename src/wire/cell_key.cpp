#include "cell_key.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "unimapper/core/quantise.hpp"

namespace unimapper::wire {

namespace {

std::uint64_t block_bits(std::int32_t centimetres) noexcept {
  return static_cast<std::uint64_t>((centimetres + 32768) >> 8);
}

std::uint64_t offset_bits(std::int32_t centimetres) noexcept {
  return static_cast<std::uint64_t>((centimetres + 32768) & 0xFF);
}

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

// All 57 bits of a key.
constexpr std::array<Digit, 5> kDigits{
    {{0, 11, 0}, {11, 11, 2048}, {22, 11, 4096}, {33, 12, 6144}, {45, 12, 10240}}};
static_assert(kDigits.back().first_count + kDigits.back().values() == CellKeyScratch::kCounts);
static_assert(kDigits.back().shift + kDigits.back().bits == 57);

/// Turns a histogram into the index at which each value's keys begin.
void accumulate(std::span<std::uint32_t> counts) noexcept {
  std::uint32_t begin = 0;
  for (std::uint32_t& count : counts) begin += std::exchange(count, begin);
}

}  // namespace

std::optional<CellKey> cell_key(const FineCell& cell) noexcept {
  const auto steps = to_centimetres(cell.position);
  if (!steps) return std::nullopt;
  CellKey key = 0;
  for (int axis = 0; axis < 3; ++axis) key = (key << 8U) | block_bits((*steps)[axis]);
  key = (key << 1U) | (cell.ground != 0 ? 0U : 1U);
  for (int axis = 0; axis < 3; ++axis) key = (key << 8U) | offset_bits((*steps)[axis]);
  return (key << 8U) | std::min<std::uint16_t>(cell.points, 255);
}

FineCell cell_of(CellKey key) noexcept {
  Eigen::Vector3i steps;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto block = static_cast<std::int32_t>((key >> (49U - 8U * axis)) & 0xFFU);
    const auto offset = static_cast<std::int32_t>((key >> (24U - 8U * axis)) & 0xFFU);
    steps[axis] = (block << 8) + offset - 32768;
  }
  FineCell cell{};
  cell.position = from_centimetres(steps);
  cell.points = static_cast<std::uint16_t>(key & 0xFFU);
  cell.ground = ((key >> 32U) & 1U) == 0 ? 1 : 0;
  return cell;
}

std::span<const CellKey> sorted_cell_keys(std::span<const FineCell> cells,
                                          const CellKeyScratch& scratch,
                                          std::uint64_t& left_out) noexcept {
  std::fill_n(scratch.counts.data(), CellKeyScratch::kCounts, 0U);
  std::size_t count = 0;
  for (const FineCell& cell : cells) {
    const std::optional<CellKey> key = cell_key(cell);
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
    const std::span<std::uint32_t> begins =
        scratch.counts.subspan(digit.first_count, digit.values());
    accumulate(begins);
    for (const CellKey key : from) to[begins[digit.of(key)]++] = key;
    std::swap(from, to);
  }
  return from;
}

}  // namespace unimapper::wire
