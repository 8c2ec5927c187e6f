// Ground height grid around a keyframe.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::place {

/// A grid of ground heights under a keyframe, in its levelled frame. Heights of structure are
/// measured from here and not from the sensor, because robots carry it at different heights.
class LocalGround {
 public:
  void allocate(Arena& arena, const DescriptorConfig& config) noexcept;

  void clear() noexcept;

  /// Takes a cell, ground or not. Others than ground matter only where nothing is marked. O(1).
  void add(const FineCell& cell) noexcept;

  /// True once a cell marked as ground was taken.
  [[nodiscard]] bool any_marked() const noexcept { return any_marked_; }

  /// Averages the cells marked as ground, or takes the lowest cells where none are (rooms without a
  /// marked floor), and lowers what rises above its surroundings more steeply than a ramp. Single
  /// patches far below their neighbours, or without any, are discarded.
  /// Independent of the cells' order. Cost: linear in the grid.
  void finish() noexcept;

  /// Calls `visit(plane)` for every patch of 2 m with at least `min_cells` cells of ground that has
  /// neighbours to estimate its slope from. The normals point up.
  template <typename Visitor>
  void for_each_plane(std::int32_t min_cells, Visitor&& visit) const noexcept {
    for (std::int32_t row = 1; row + 1 < width_; ++row) {
      for (std::int32_t column = 1; column + 1 < width_; ++column) {
        PlanePatch plane;
        if (make_plane(column, row, min_cells, plane)) visit(plane);
      }
    }
  }

  /// Height of the ground below (x, y), metres, interpolated; finite everywhere.
  [[nodiscard]] float height(float x, float y) const noexcept {
    if (width_ < 2) return 0.0F;
    const float limit = static_cast<float>(width_) - 1.001F;
    const float u = std::clamp((x + half_extent_m_) / kPatchSize - 0.5F, 0.0F, limit);
    const float v = std::clamp((y + half_extent_m_) / kPatchSize - 0.5F, 0.0F, limit);
    const auto column = static_cast<std::int32_t>(u);
    const auto row = static_cast<std::int32_t>(v);
    const float fu = u - static_cast<float>(column);
    const float fv = v - static_cast<float>(row);
    const float* at = heights_ + row * width_ + column;
    const float near = at[0] + fu * (at[1] - at[0]);
    const float far = at[width_] + fu * (at[width_ + 1] - at[width_]);
    return near + fv * (far - near);
  }

 private:
  static constexpr float kPatchSize = 2.0F;  // metres
  // Sums in millimetres: integers, so that the result does not depend on the cells' order.
  struct Patch {
    std::int64_t sum_mm;
    std::int32_t count;
    std::int32_t lowest_mm;
  };
  bool make_plane(std::int32_t column, std::int32_t row, std::int32_t min_cells,
                  PlanePatch& plane) const noexcept;
  void discard_pits() noexcept;
  void limit_slope() noexcept;
  void fill_gaps() noexcept;

  bool any_marked_ = false;
  Patch* patches_ = nullptr;
  float* heights_ = nullptr;
  std::int32_t width_ = 0;
  float half_extent_m_ = 0.0F;
};

}  // namespace unimapper::place
