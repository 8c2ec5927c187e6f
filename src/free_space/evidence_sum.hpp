// Evidence of cells that are classified together
#pragma once

#include <cstdint>

#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper {

/// Evidence of a set of cells, log-odds of "dynamic" in thousandths.
struct EvidenceSum {
  std::int64_t log_odds = 0;   ///< of all cells
  std::uint32_t cells = 0;     ///< cells
  std::uint32_t dynamic = 0;   ///< cells whose own evidence says dynamic
  std::uint32_t occupied = 0;  ///< observations of their voxels as occupied by other keyframes

  /// One more cell, whose voxel `times` other keyframes occupied.
  void add(std::int32_t cell_log_odds, std::uint32_t times) noexcept {
    log_odds += cell_log_odds;
    ++cells;
    dynamic += cell_log_odds > 0 ? 1 : 0;
    occupied += times;
  }
  EvidenceSum& operator+=(const EvidenceSum& other) noexcept {
    log_odds += other.log_odds;
    cells += other.cells;
    dynamic += other.dynamic;
    occupied += other.occupied;
    return *this;
  }
  /// Evidence per cell, rounded towards zero; 0 without cells.
  [[nodiscard]] std::int64_t mean() const noexcept {
    return cells == 0 ? 0 : log_odds / static_cast<std::int64_t>(cells);
  }
};

/// When connected cells that were seen through moved, although they touch what did not: they are
/// many, two fifths were seen through themselves, clearly on average, and other keyframes hardly
/// ever occupied their voxels. Rays that graze a wall see through single cells of it, or through
/// cells that other keyframes observed as occupied.
struct MovedPart {
  std::uint32_t min_cells;  ///< cells
  std::int32_t min_mean;    ///< thousandths per cell
  float max_occupied;       ///< other keyframes per cell

  /// Whether the part moved. O(1).
  [[nodiscard]] bool holds(const EvidenceSum& part) const noexcept {
    return part.cells >= min_cells &&
           5 * std::uint64_t{part.dynamic} >= 2 * std::uint64_t{part.cells} &&
           part.log_odds >= std::int64_t{min_mean} * part.cells &&
           static_cast<float>(part.occupied) <= max_occupied * static_cast<float>(part.cells);
  }
};

}  // namespace unimapper
