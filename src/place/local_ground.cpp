#include "local_ground.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace unimapper::place {
namespace {

constexpr float kNoHeight = 1e9F;
// Ground climbs at most this much per patch: 30 %, the steepest road.
constexpr float kClimbPerPatch = 0.3F * 2.0F;
// Kerbs and ditches are no deeper.
constexpr float kDeepestPit = 1.5F;

}  // namespace

void LocalGround::allocate(Arena& arena, const DescriptorConfig& config) noexcept {
  const auto half = static_cast<std::int32_t>(std::ceil(config.range_m / kPatchSize)) + 1;
  width_ = 2 * half;
  half_extent_m_ = static_cast<float>(half) * kPatchSize;
  const auto count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_);
  patches_ = arena.allocate<Patch>(count);
  heights_ = arena.allocate<float>(count);
  if (patches_ == nullptr || heights_ == nullptr) width_ = 0;
}

void LocalGround::clear() noexcept {
  any_marked_ = false;
  const auto count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_);
  for (std::size_t i = 0; i < count; ++i) {
    patches_[i] = {0, 0, std::numeric_limits<std::int32_t>::max()};
  }
}

void LocalGround::add(const FineCell& cell) noexcept {
  constexpr float kReach = 1e6F;  // beyond, millimetres would not fit
  const float u = (cell.position.x() + half_extent_m_) / kPatchSize;
  const float v = (cell.position.y() + half_extent_m_) / kPatchSize;
  const auto limit = static_cast<float>(width_);
  if (!(u >= 0.0F && v >= 0.0F && u < limit && v < limit)) return;
  if (!(std::abs(cell.position.z()) < kReach)) return;
  Patch& patch = patches_[static_cast<std::int32_t>(v) * width_ + static_cast<std::int32_t>(u)];
  const auto z_mm = static_cast<std::int32_t>(cell.position.z() * 1000.0F);
  patch.lowest_mm = std::min(patch.lowest_mm, z_mm);
  if (cell.ground == 0) return;
  any_marked_ = true;
  patch.sum_mm += z_mm;
  ++patch.count;
}

void LocalGround::finish() noexcept {
  const auto count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_);
  for (std::size_t i = 0; i < count; ++i) {
    const Patch& patch = patches_[i];
    heights_[i] = kNoHeight;
    if (patch.count == 0) continue;
    const auto mean_mm = patch.sum_mm / patch.count;
    heights_[i] = static_cast<float>(mean_mm) * 0.001F;
  }
  if (!any_marked_) {
    for (std::size_t i = 0; i < count; ++i) {
      if (patches_[i].lowest_mm == std::numeric_limits<std::int32_t>::max()) continue;
      heights_[i] = static_cast<float>(patches_[i].lowest_mm) * 0.001F;
    }
  }
  discard_pits();
  fill_gaps();
  limit_slope();
}

// A single patch far below all around it, or with nothing around it, may be a reflection and would
// lower its surroundings.
void LocalGround::discard_pits() noexcept {
  for (std::int32_t row = 1; row + 1 < width_; ++row) {
    for (std::int32_t column = 1; column + 1 < width_; ++column) {
      float* at = heights_ + row * width_ + column;
      float lowest_around = kNoHeight;
      for (std::int32_t dy = -1; dy <= 1; ++dy) {
        for (std::int32_t dx = -1; dx <= 1; ++dx) {
          if (dx != 0 || dy != 0) lowest_around = std::min(lowest_around, at[dy * width_ + dx]);
        }
      }
      if (*at < lowest_around - kDeepestPit) *at = kNoHeight;
    }
  }
}

// The lowest cell of a patch may be halfway up a wall or a table top, and what is marked as ground
// may be a roof: ground is what lies below every ramp that rises from its surroundings.
void LocalGround::limit_slope() noexcept {
  for (std::int32_t pass = 0; pass < 2; ++pass) {
    for (std::int32_t step = 0; step < width_ * width_; ++step) {
      const std::int32_t i = pass == 0 ? step : width_ * width_ - 1 - step;
      const std::int32_t x = i % width_;
      const std::int32_t y = i / width_;
      const std::int32_t back = pass == 0 ? -1 : 1;
      float& height = heights_[i];
      if (x + back >= 0 && x + back < width_) {
        height = std::min(height, heights_[i + back] + kClimbPerPatch);
      }
      if (y + back >= 0 && y + back < width_) {
        height = std::min(height, heights_[i + back * width_] + kClimbPerPatch);
      }
    }
  }
}

bool LocalGround::make_plane(std::int32_t column, std::int32_t row, std::int32_t min_cells,
                             PlanePatch& plane) const noexcept {
  const std::int32_t at = row * width_ + column;
  if (patches_[at].count < min_cells) return false;
  // Rise per metre along an axis, from the neighbours that have ground; false if none has.
  const auto slope = [&](std::int32_t stride, float& rise) {
    const std::int32_t before = patches_[at - stride].count > 0 ? at - stride : at;
    const std::int32_t after = patches_[at + stride].count > 0 ? at + stride : at;
    if (before == after) return false;
    const auto steps = static_cast<float>((after - before) / stride);
    rise = (heights_[after] - heights_[before]) / (steps * kPatchSize);
    return true;
  };
  float rise_x = 0.0F;
  float rise_y = 0.0F;
  if (!slope(1, rise_x) || !slope(width_, rise_y)) return false;
  const auto middle = [this](std::int32_t i) {
    return (static_cast<float>(i) + 0.5F) * kPatchSize - half_extent_m_;
  };
  plane.center = {middle(column), middle(row), heights_[at]};
  plane.normal = Eigen::Vector3f(-rise_x, -rise_y, 1.0F).normalized();
  return true;
}

// Gives every patch without a height that of the nearest one with a height (along rows, then
// columns, there and back), so that interpolation never meets a hole.
void LocalGround::fill_gaps() noexcept {
  const auto sweep = [this](std::int32_t start, std::int32_t stride) {
    float last = kNoHeight;
    for (std::int32_t k = 0; k < width_; ++k) {
      float& height = heights_[start + k * stride];
      if (height == kNoHeight) {
        height = last;
      } else {
        last = height;
      }
    }
  };
  for (std::int32_t round = 0; round < 2; ++round) {
    for (std::int32_t row = 0; row < width_; ++row) {
      sweep(row * width_, 1);
      sweep(row * width_ + width_ - 1, -1);
    }
    for (std::int32_t column = 0; column < width_; ++column) {
      sweep(column, width_);
      sweep((width_ - 1) * width_ + column, -width_);
    }
  }
  for (std::int32_t i = 0; i < width_ * width_; ++i) {
    if (heights_[i] == kNoHeight) heights_[i] = 0.0F;
  }
}

}  // namespace unimapper::place
