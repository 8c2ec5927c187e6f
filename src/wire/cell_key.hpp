// Sort key of a quantised cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "unimapper/core/keyframe.hpp"

namespace unimapper::wire {

/// One cell as it travels, ordered as it travels: by 2.56 m block, ground before the rest, by
/// position, by points. From the top: block x y z (8 bits each, offset 128), not-ground (1),
/// x y z within the block in cm (8 each), points (8).
using CellKey = std::uint64_t;

/// The key of a cell, or nothing if its position is not finite or does not fit the grid.
std::optional<CellKey> cell_key(const FineCell& cell) noexcept;

/// The cell of a key.
FineCell cell_of(CellKey key) noexcept;

/// Memory `sorted_cell_keys` works in; every span but `counts` holds as many keys as there may be
/// cells.
struct CellKeyScratch {
  static constexpr std::size_t kCounts = 3 * 2048 + 2 * 4096;  ///< length of `counts`

  std::span<CellKey> keys;          ///< the result
  std::span<CellKey> spare;         ///< of the same length as `keys`
  std::span<std::uint32_t> counts;  ///< `kCounts` of them
};

/// The keys of `cells` in ascending order, in one of the scratch arrays. Cells without a key, and
/// those beyond the scratch memory, are added to `left_out`. Radix sort, O(cells).
std::span<const CellKey> sorted_cell_keys(std::span<const FineCell> cells,
                                          const CellKeyScratch& scratch,
                                          std::uint64_t& left_out) noexcept;

}  // namespace unimapper::wire
