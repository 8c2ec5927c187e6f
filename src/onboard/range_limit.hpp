// Range limit of removal under a time budget
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "cell_table.hpp"

namespace unimapper::onboard {

/// Which candidates are left.
struct RangeLimit {
  std::uint32_t kept = 0;
  std::uint32_t shed = 0;  ///< no candidates any more, they stay static
  float range_m = 0.0F;    ///< beyond it they were shed; 0 = none were
};

/// Keeps at most `limit` candidates, those nearest to `center` (metres from the grid's origin):
/// whole rings, `range_max_m` / 64 wide, so that the answer does not depend on the order of the
/// cells. O(cells).
RangeLimit keep_nearest(CellTable& cells, const Eigen::Vector3f& center, float range_max_m,
                        std::uint32_t limit) noexcept;

}  // namespace unimapper::onboard
