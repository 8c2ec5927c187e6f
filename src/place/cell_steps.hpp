// Grid indices of cell positions, three axes at a time.
#pragma once

#include <cstdint>

#include "unimapper/core/keyframe.hpp"

namespace unimapper::place {

/// A grid whose origin lies below every position converted: truncation then equals rounding down,
/// which takes one vector instruction for all axes.
class CellSteps {
 public:
  struct Steps {
    std::int32_t x;
    std::int32_t y;
    std::int32_t z;
  };

  /// Step s of an axis begins at (s - `origin`) / `steps_per_m` metres.
  CellSteps(float steps_per_m, float origin) noexcept
      : scale_{steps_per_m, steps_per_m, steps_per_m, 0.0F},
        origin_{origin, origin, origin, 0.0F} {}

  /// The steps in which a cell lies. Its position must be finite and not lie before step 0.
  [[nodiscard]] Steps of(const FineCell& cell) const noexcept {
    const Floats position = {cell.position.x(), cell.position.y(), cell.position.z(), 0.0F};
    const Lanes steps = __builtin_convertvector(position * scale_ + origin_, Lanes);
    return {steps[0], steps[1], steps[2]};
  }

 private:
  using Floats = float __attribute__((vector_size(16)));
  using Lanes = std::int32_t __attribute__((vector_size(16)));
  Floats scale_;
  Floats origin_;
};

}  // namespace unimapper::place
