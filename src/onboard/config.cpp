#include "unimapper/onboard/config.hpp"

namespace unimapper {
namespace {

/// Written so that NaN is outside of everything.
bool within(float value, float low, float high) noexcept { return value >= low && value <= high; }
bool within(std::uint32_t value, std::uint32_t low, std::uint32_t high) noexcept {
  return value >= low && value <= high;
}

Error invalid(const char* message) noexcept { return {ErrorCode::kInvalidConfig, message}; }

}  // namespace

Error KeyframeConfig::validate() const noexcept {
  if (!within(scans, 1, kMaxScans)) return invalid("keyframe.scans must be 1 to 32");
  if (!within(distance_m, 0.0F, 1000.0F))
    return invalid("keyframe.distance_m must be 0 (off) to 1000 metres");
  if (!within(range_min_m, 0.0F, 500.0F) || !within(range_max_m, 0.0F, 500.0F) ||
      range_min_m >= range_max_m)
    return invalid("keyframe.range_min_m must be below range_max_m, both 0 to 500 metres");
  if (downsample_leaf_m != 0.0F && !within(downsample_leaf_m, 0.02F, 2.0F))
    return invalid("keyframe.downsample_leaf_m must be 0 (off) or 0.02 to 2 metres");
  if (!within(max_pose_step_m, 1e-3F, 1000.0F))
    return invalid("keyframe.max_pose_step_m must be above 0 and at most 1000 metres");
  if (!within(max_speed_mps, 0.0F, 1000.0F))
    return invalid("keyframe.max_speed_mps must be 0 to 1000 m/s");
  if (!within(max_points_per_scan, 1, 1U << 22U))
    return invalid("keyframe.max_points_per_scan must be 1 to 4194304");
  return {};
}

std::int32_t VoxelConfig::cells_per_voxel() const noexcept {
  return static_cast<std::int32_t>(coarse_size_m / fine_size_m + 0.5F);
}

Error VoxelConfig::validate() const noexcept {
  if (!within(fine_size_m, 0.05F, 1.0F))
    return invalid("voxel.fine_size_m must be 0.05 to 1 metre");
  if (!within(coarse_size_m, 0.1F, 64.0F))
    return invalid("voxel.coarse_size_m must be 0.1 to 64 metres");
  const float ratio = coarse_size_m / fine_size_m;
  const float misfit = ratio - static_cast<float>(cells_per_voxel());
  if (!within(ratio, 1.9F, 64.1F) || !within(misfit, -1e-3F, 1e-3F))
    return invalid("voxel.coarse_size_m must be 2 to 64 times voxel.fine_size_m, a whole multiple");
  if (!within(plane_max_eigenvalue_m2, 1e-9F, 1.0F))
    return invalid("voxel.plane_max_eigenvalue_m2 must be above 0 and at most 1 m^2");
  if (!within(plane_min_points, 3, 10000))
    return invalid("voxel.plane_min_points must be 3 to 10000");
  if (!within(max_cells, 1, 1U << 23U)) return invalid("voxel.max_cells must be 1 to 8388608");
  if (!within(max_window_blocks, 1, 1U << 22U)) {
    return invalid("voxel.max_window_blocks must be 1 to 4194304");
  }
  if (!within(max_voxels, 1, 1U << 20U)) return invalid("voxel.max_voxels must be 1 to 1048576");
  return {};
}

Error GroundConfig::validate() const noexcept {
  if (!within(max_tilt_deg, 1e-3F, 80.0F))
    return invalid("ground.max_tilt_deg must be above 0 and at most 80 degrees");
  if (!within(margin_m, -0.5F, 1.0F)) return invalid("ground.margin_m must be -0.5 to 1 metre");
  if (!within(below_depth_m, 0.0F, 100.0F))
    return invalid("ground.below_depth_m must be 0 to 100 metres");
  if (elevated_step_m != 0.0F && !within(elevated_step_m, 0.1F, 2.0F))
    return invalid("ground.elevated_step_m must be 0 (off) or 0.1 to 2 metres");
  if (!within(elevated_reach_m, 2.0F, 50.0F))
    return invalid("ground.elevated_reach_m must be 2 to 50 metres");
  if (propagation_voxels < 1 || propagation_voxels > 4)
    return invalid("ground.propagation_voxels must be 1 to 4 voxels");
  if (!within(seen_through_share, 0.0F, 1.0F))
    return invalid("ground.seen_through_share must be 0 (off) to 1");
  return {};
}

Error FreeSpaceConfig::validate() const noexcept {
  if (!columns && !visibility)
    return invalid("free_space.columns or free_space.visibility must be on");
  if (!within(images_per_keyframe, 1, kMaxImages))
    return invalid("free_space.images_per_keyframe must be 1 to 32");
  if (!within(earlier_image_stride, 1, kMaxImages))
    return invalid("free_space.earlier_image_stride must be 1 to 32");
  if (!within(azimuth_resolution_deg, 0.1F, 5.0F) || !within(elevation_resolution_deg, 0.1F, 5.0F))
    return invalid("free_space's azimuth and elevation resolution must be 0.1 to 5 degrees");
  if (!within(horizontal_fov_deg, 1.0F, 360.0F))
    return invalid("free_space.horizontal_fov_deg must be 1 to 360 degrees");
  if (!within(elevation_min_deg, -90.0F, 90.0F) || !within(elevation_max_deg, -90.0F, 90.0F) ||
      elevation_min_deg >= elevation_max_deg)
    return invalid(
        "free_space.elevation_min_deg must be below elevation_max_deg, both -90 to 90 degrees");
  if (!within(min_returns, 1, 9)) return invalid("free_space.min_returns must be 1 to 9");
  if (!within(range_margin_m, 0.05F, 5.0F))
    return invalid("free_space.range_margin_m must be 0.05 to 5 metres");
  if (!within(range_margin_relative, 0.0F, 0.2F))
    return invalid("free_space.range_margin_relative must be 0 to 0.2");
  if (!within(full_weight_range_m, 0.0F, 500.0F))
    return invalid("free_space.full_weight_range_m must be 0 (off) to 500 metres");
  return {};
}

Error RemovalConfig::validate() const noexcept {
  if (!within(window, 1, kMaxWindow)) return invalid("removal.window must be 1 to 32 keyframes");
  if (!within(log_odds_free, 0.0F, 10.0F) || !within(log_odds_occupied, 0.0F, 10.0F) ||
      !within(log_odds_weakly_occupied, 0.0F, 10.0F))
    return invalid("removal's log-odds increments must be 0 to 10");
  if (!within(log_odds_clamp, 0.0F, 30.0F))
    return invalid("removal.log_odds_clamp must be 0 (off) to 30");
  if (!within(connecting_height_m, 0.0F, 2.0F))
    return invalid("removal.connecting_height_m must be 0 to 2 metres");
  if (!within(component_dynamic_share, 0.0F, 1.0F) || !within(component_static_share, 0.0F, 1.0F) ||
      component_static_share > component_dynamic_share)
    return invalid(
        "removal.component_static_share must not exceed component_dynamic_share, both 0 to 1");
  if (!within(confirmed_static_log_odds, 1e-3F, 1000.0F))
    return invalid("removal.confirmed_static_log_odds must be above 0 and at most 1000");
  if (!within(persistence_share, 0.0F, 1.0F))
    return invalid("removal.persistence_share must be 0 (off) to 1");
  return {};
}

Error PipelineConfig::validate() const noexcept {
  for (const Error& error :
       {keyframe.validate(), voxel.validate(), ground.validate(), free_space.validate(),
        removal.validate(), descriptor.validate(), loop_search.validate()}) {
    if (error.code != ErrorCode::kOk) return error;
  }
  if (free_space.images_per_keyframe > keyframe.scans)
    return invalid("free_space.images_per_keyframe must not exceed keyframe.scans");
  if (descriptor.max_keypoints > loop_search.max_keypoints ||
      descriptor.max_planes > loop_search.max_planes)
    return invalid("loop_search must have room for every keypoint and plane of the descriptor");
  if (budget_us != 0 && !within(budget_us, 100, 10000000))
    return invalid("budget_us must be 0 (off) or 100 to 10000000 microseconds");
  if (budget_us != 0 && clock_ns == nullptr)
    return invalid("budget_us needs a clock: set clock_ns");
  return {};
}

}  // namespace unimapper
