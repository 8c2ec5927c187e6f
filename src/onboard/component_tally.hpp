// Tally of a connected component
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "unimapper/core/voxel_key.hpp"
#include "unimapper/free_space/block.hpp"

namespace unimapper::onboard {

/// The smallest box around some cells, in cells of the keyframe's grid.
struct CellBox {
  static constexpr std::int32_t kNarrow = 2;  ///< width that a single pole may fill

  std::int16_t low[3] = {INT16_MAX, INT16_MAX, INT16_MAX};   ///< x, y, z
  std::int16_t high[3] = {INT16_MIN, INT16_MIN, INT16_MIN};  ///< x, y, z; among the cells

  /// Takes in some cells of the block at `block`, at least one.
  void include(const VoxelIndex& block, std::uint64_t cells) noexcept {
    std::uint64_t columns = cells | cells >> 32U;
    columns |= columns >> 16U;  // what of the 4 x 4 columns holds a cell
    auto x = static_cast<std::uint32_t>(columns & 0xFFFFU);
    const std::uint32_t y = (x | x >> 1U | x >> 2U | x >> 3U) & 0x1111U;
    x = (x | x >> 4U | x >> 8U | x >> 12U) & 0xFU;
    const std::int32_t first[3] = {std::countr_zero(x), std::countr_zero(y) >> 2,
                                   std::countr_zero(cells) >> 4};
    const std::int32_t last[3] = {31 - std::countl_zero(x), (31 - std::countl_zero(y)) >> 2,
                                  (63 - std::countl_zero(cells)) >> 4};
    const VoxelIndex base = cell_in(block, 0);
    const std::int32_t at[3] = {base.x, base.y, base.z};
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], narrow(at[axis] + first[axis]));
      high[axis] = std::max(high[axis], narrow(at[axis] + last[axis]));
    }
  }

  /// Cells along the longer horizontal axis, and upwards; meaningless without cells.
  [[nodiscard]] std::int32_t width() const noexcept {
    return std::max(high[0] - low[0], high[1] - low[1]) + 1;
  }
  [[nodiscard]] std::int32_t height() const noexcept { return high[2] - low[2] + 1; }

 private:
  static std::int16_t narrow(std::int32_t cell) noexcept {
    return static_cast<std::int16_t>(std::clamp<std::int32_t>(cell, INT16_MIN, INT16_MAX));
  }
};

/// What is known of a component.
struct ComponentTally {
  std::uint32_t cells = 0;
  std::uint32_t evidence = 0;          ///< magnitudes of the cells' log-odds, each clamped
  std::uint32_t evidence_dynamic = 0;  ///< of those that say dynamic
  std::uint32_t was_dynamic = 0;
  std::uint32_t was_static = 0;
  CellBox box;  ///< of all but low cells; wider than a pole, where it is not complete
};

}  // namespace unimapper::onboard
