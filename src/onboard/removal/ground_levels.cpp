#include "ground_levels.hpp"

#include <algorithm>

namespace unimapper::onboard {
namespace {

/// Ground farther below than this is another storey, not the ground beside a vehicle.
constexpr float kStoreyM = 2.0F;

/// Whether `upper` lies between a step and a storey above the plane of `lower`, and `lower` a step
/// below that of `upper`: both planes must say so, or every slope would be elevated above its foot.
bool lies_above(const CoarseVoxel& upper, const CoarseVoxel& lower, float step_m) noexcept {
  const Eigen::Vector3f between = upper.mean - lower.mean;
  const float above = lower.normal.dot(between);
  if (!(above > step_m && above < kStoreyM)) return false;
  const float least_m = step_m + kPlaneErrorPerMetre * between.head<2>().norm();
  return above > least_m && upper.normal.dot(between) > least_m;
}

}  // namespace

void GroundLevels::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  step_m_ = config.ground.elevated_step_m;
  const float size_m = config.voxel.coarse_size_m;
  reach_ = static_cast<std::int32_t>(GroundConfig::kElevatedReachM / size_m + 0.5F);
  // A keyframe's grid begins where its first scan was taken; what lies farther out is not tested.
  constexpr std::int32_t kMostColumns = 256;
  const auto half = static_cast<std::int32_t>(config.keyframe.range_max_m / size_m) + 8;
  width_ = step_m_ > 0.0F ? std::min(2 * half, kMostColumns) : 0;
  lowest_ = arena.allocate<std::uint32_t>(static_cast<std::size_t>(width_) *
                                          static_cast<std::size_t>(width_));
}

std::uint32_t GroundLevels::reject_elevated(FixedHashMap<CoarseVoxel>& voxels,
                                            const Executor& executor) noexcept {
  if (width_ == 0) return 0;
  collect(voxels);
  // All are tested before any is taken out: the order must not matter.
  for_slices(executor, {0, voxels.size()}, kVoxelsPerPart, [&](Slice some, std::uint32_t) noexcept {
    for (std::uint32_t i = some.first; i < some.end; ++i) {
      voxels[i].elevated = voxels[i].ground && is_elevated(voxels, i);
    }
  });
  std::uint32_t count = 0;
  for (CoarseVoxel& voxel : voxels.values()) {
    voxel.ground = voxel.ground && !voxel.elevated;
    count += voxel.elevated ? 1U : 0U;
  }
  return count;
}

void GroundLevels::collect(const FixedHashMap<CoarseVoxel>& voxels) noexcept {
  std::fill_n(lowest_, width_ * width_, kNone);
  for (std::uint32_t i = 0; i < voxels.size(); ++i) {
    if (!voxels[i].ground) continue;
    const VoxelIndex index = unpack(voxels.key(i));
    const std::int32_t x = index.x + width_ / 2;
    const std::int32_t y = index.y + width_ / 2;
    if (x < 0 || y < 0 || x >= width_ || y >= width_) continue;
    std::uint32_t& entry = lowest_[y * width_ + x];
    if (entry == kNone || voxels[i].mean.z() < voxels[entry].mean.z()) entry = i;
  }
}

bool GroundLevels::is_elevated(const FixedHashMap<CoarseVoxel>& voxels,
                               std::uint32_t entry) const noexcept {
  const VoxelIndex index = unpack(voxels.key(entry));
  const std::int32_t x = index.x + width_ / 2;
  const std::int32_t y = index.y + width_ / 2;
  const std::int32_t last_x = std::min(x + reach_, width_ - 1);
  const std::int32_t last_y = std::min(y + reach_, width_ - 1);
  for (std::int32_t row = std::max(y - reach_, 0); row <= last_y; ++row) {
    for (std::int32_t column = std::max(x - reach_, 0); column <= last_x; ++column) {
      const std::uint32_t other = lowest_[row * width_ + column];
      if (other == kNone || other == entry) continue;
      if (lies_above(voxels[entry], voxels[other], step_m_)) return true;
    }
  }
  return false;
}

}  // namespace unimapper::onboard
