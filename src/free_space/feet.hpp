// Level of the ground below what moves
//
// Ground cells hold the feet of who stands on them. Robot (online labels) and base (refined labels)
// take what rises above the ground around for feet; how they find that ground is up to them.
#pragma once

#include <cstddef>
#include <span>

#include "src/core/quantile.hpp"

namespace unimapper {

/// Level of the ground about a cell below something dynamic, from the heights of the ground cells
/// around it: `free` are those with nothing dynamic above, of which `level_of` takes the level;
/// `all` are those and the others, the cell itself among them. Both may be reordered.
template <typename LevelOf>
[[nodiscard]] float ground_level(std::span<float> free, std::span<float> all,
                                 const LevelOf& level_of) noexcept {
  constexpr std::size_t kFewestFree = 3;
  // Where all of it holds feet, the lower cells hold fewer.
  return free.size() < kFewestFree ? quantile(all, 0.25) : level_of(free);
}

}  // namespace unimapper
