// Outline of a connected component
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "block.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper {

/// The smallest box around some cells, in cells of a grid whose origin is no more than 32,767 cells
/// away from them.
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
  /// Cells from the lowest to the highest, both counted.
  [[nodiscard]] std::int32_t height() const noexcept { return high[2] - low[2] + 1; }

 private:
  static std::int16_t narrow(std::int32_t cell) noexcept {
    return static_cast<std::int16_t>(std::clamp<std::int32_t>(cell, INT16_MIN, INT16_MAX));
  }
};

/// Outlines that tell a pole from what moves.
enum class Outline : std::uint8_t {
  kWide,      ///< wider than a pole
  kFragment,  ///< as narrow as a pole, and low: of a pole, or of anything
  kPole,      ///< as narrow as a pole and higher than wide
};

/// Cells: no lamp's arm is longer, and what is wider needs no complete box.
inline constexpr std::int32_t kWidestPole = 12;

/// The outline of a component from the box around all of its cells but low ones
/// (docs/design/components.md).
[[nodiscard]] inline Outline outline_of(const CellBox& box, float cell_size_m) noexcept {
  constexpr std::int32_t kSign = 4;         // cells: a sign on its pole
  constexpr float kFragment_m = 1.0F;       // no higher: anything
  constexpr float kNobody_m = 2.2F;         // higher than a person
  constexpr std::int32_t kSlenderness = 3;  // and so many times as high as wide
  const std::int32_t width = box.width();
  if (width > kWidestPole) return Outline::kWide;
  const float height_m = cell_size_m * static_cast<float>(box.height());
  if (width <= CellBox::kNarrow)
    return height_m >= kFragment_m ? Outline::kPole : Outline::kFragment;
  const bool slender = width <= std::max(kSign, box.height() / kSlenderness);
  return slender && height_m >= kNobody_m ? Outline::kPole : Outline::kWide;
}

}  // namespace unimapper
