// Sort key of a quantised cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "cell_grid.hpp"
#include "unimapper/core/keyframe.hpp"

namespace unimapper::wire {

/// One cell as it travels, ordered as it travels: by block of 32 cells, by cell within the block,
/// ground before the rest, by part of the cell. From the top: block x y z (8 bits each), cell x y z
/// (5 each), not-ground (1), part x (1), y (1), z (2). Above them its intensity (8), by which equal
/// ones are ordered.
using CellKey = std::uint64_t;
inline constexpr unsigned kIntensityShift = 44;

/// Parts of a key.
constexpr std::uint32_t block_of(CellKey key) noexcept {
  return static_cast<std::uint32_t>(key >> 20U) & 0xFFFFFFU;
}
constexpr std::uint32_t index_in_block(CellKey key) noexcept {
  return static_cast<std::uint32_t>(key >> 5U) & 0x7FFFU;
}
constexpr bool is_same_cell(CellKey a, CellKey b) noexcept {
  return ((a ^ b) & ((CellKey{1} << kIntensityShift) - 1)) >> 5U == 0;
}
constexpr std::uint8_t intensity_of(CellKey key) noexcept {
  return static_cast<std::uint8_t>(key >> kIntensityShift);
}
constexpr bool is_ground(CellKey key) noexcept { return ((key >> 4U) & 1U) == 0; }

/// The key of a cell, or nothing if its position is not finite or does not fit the grid.
std::optional<CellKey> cell_key(const FineCell& cell, const CellGrid& grid) noexcept;

/// Memory `sorted_cell_keys` works in; every span but `counts` holds as many keys as there may be
/// cells.
struct CellKeyScratch {
  static constexpr std::size_t kCounts = 4 * 2048 + 256;  ///< length of `counts`

  std::span<CellKey> keys;          ///< room; the result lies here or in `spare`
  std::span<CellKey> spare;         ///< of the same length as `keys`
  std::span<std::uint32_t> counts;  ///< `kCounts` of them
};

/// The keys of `cells` in ascending order, in one of the scratch arrays. Cells without a key, and
/// those beyond the scratch memory, are added to `left_out`. Radix sort, O(cells).
std::span<const CellKey> sorted_cell_keys(std::span<const FineCell> cells, const CellGrid& grid,
                                          const CellKeyScratch& scratch,
                                          std::uint64_t& left_out) noexcept;

}  // namespace unimapper::wire
