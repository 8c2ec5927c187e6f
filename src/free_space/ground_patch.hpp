// Ground that was seen through
#pragma once

#include <cstdint>

namespace unimapper {

/// Cells of one patch of ground, and how many of them other views saw through. Where a sensor
/// hardly sees the ground, the roof of a passing car is the lowest plane there is. Single cells of
/// a real road are seen through, too, where rays graze it; whole patches are not.
struct GroundPatch {
  std::uint16_t cells = 0;         ///< cells of the patch
  std::uint16_t seen_through = 0;  ///< cells of the patch that other views saw through

  /// Counts one cell more, up to 65535.
  void add(bool is_seen_through) noexcept {
    if (cells == UINT16_MAX) return;
    ++cells;
    seen_through = static_cast<std::uint16_t>(seen_through + (is_seen_through ? 1 : 0));
  }
  /// At least `share` of the patch was seen through: it is no ground. With fewer than
  /// `fewest_cells` nothing is decided.
  [[nodiscard]] bool is_transparent(float share, std::uint32_t fewest_cells) const noexcept {
    return cells >= fewest_cells &&
           !(static_cast<float>(seen_through) < share * static_cast<float>(cells));
  }
};

}  // namespace unimapper
