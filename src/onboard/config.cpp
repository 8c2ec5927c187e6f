// Validation of the onboard pipeline's parameters.
#include "unimapper/onboard/config.hpp"

namespace unimapper {
namespace {

constexpr Error invalid(const char* message) noexcept {
  return {ErrorCode::kInvalidConfig, message};
}

}  // namespace

Error OdometryConfig::validate() const noexcept { return check_ranges(*this); }

Error KeyframeConfig::validate() const noexcept {
  const Error error = check_ranges(*this);
  if (error.code != ErrorCode::kOk) return error;
  if (range_min_m >= range_max_m) {
    return invalid("keyframe.range_min_m must be below keyframe.range_max_m");
  }
  return {};
}

std::int32_t VoxelConfig::cells_per_voxel() const noexcept {
  return static_cast<std::int32_t>(coarse_size_m / fine_size_m + 0.5F);
}

Error VoxelConfig::validate() const noexcept {
  const Error error = check_ranges(*this);
  if (error.code != ErrorCode::kOk) return error;
  const float ratio = coarse_size_m / fine_size_m;
  const float misfit = ratio - static_cast<float>(cells_per_voxel());
  if (ratio < 1.9F || ratio > 64.1F || misfit < -1e-3F || misfit > 1e-3F) {
    return invalid("voxel.coarse_size_m must be 2 to 64 times voxel.fine_size_m, a whole multiple");
  }
  if (max_window_blocks < max_blocks()) {
    return invalid(
        "voxel.max_window_blocks must have room for one keyframe: at least a quarter of "
        "voxel.max_cells, or a fifth and 4096");
  }
  return {};
}

Error GroundConfig::validate() const noexcept { return check_ranges(*this); }

Error FreeSpaceConfig::validate() const noexcept {
  const Error error = check_ranges(*this);
  if (error.code != ErrorCode::kOk) return error;
  if (!columns && !visibility) {
    return invalid("free_space.columns or free_space.visibility must be true");
  }
  if ((ray_spacing_deg > 0.0F) != (ring_spacing_deg > 0.0F)) {
    return invalid("free_space.ring_spacing_deg must be 0 just if free_space.ray_spacing_deg is");
  }
  if (elevation_min_deg >= elevation_max_deg) {
    return invalid("free_space.elevation_min_deg must be below free_space.elevation_max_deg");
  }
  return {};
}

Error RemovalConfig::validate() const noexcept { return check_ranges(*this); }

Error PipelineConfig::validate() const noexcept {
  for (const Error& error : {check_ranges(*this), odometry.validate(), keyframe.validate(),
                             voxel.validate(), ground.validate(), free_space.validate(),
                             removal.validate(), descriptor.validate(), loop_search.validate()}) {
    if (error.code != ErrorCode::kOk) return error;
  }
  if (free_space.images_per_keyframe > keyframe.scans) {
    return invalid("free_space.images_per_keyframe must not exceed keyframe.scans");
  }
  if (std::uint64_t{loop_search.max_places} * descriptor.max_planes > (1ULL << 30U)) {
    return invalid("loop_search.max_places times descriptor.max_planes must not exceed 2^30");
  }
  if (budget_us != 0 && clock_ns == nullptr) {
    return invalid("budget_us needs a clock: set clock_ns");
  }
  const std::uint32_t most = executor.run != nullptr ? Executor::kMaxWorkers : 1;
  if (executor.workers < 1 || executor.workers > most) {
    return invalid("executor.workers must be in [1, 8], and 1 without executor.run");
  }
  return {};
}

}  // namespace unimapper
