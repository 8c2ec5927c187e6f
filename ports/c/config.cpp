#include "ports/c/config.hpp"

#include <cstring>
#include <type_traits>

namespace unimapper::c {
namespace {

constexpr std::size_t kHeaderBytes = offsetof(um_config, keyframe_scans);
static_assert(sizeof(um_config) == offsetof(um_config, reserved) + sizeof(um_config::reserved),
              "a gap at the end would hide the next version's first member");
static_assert(sizeof(SearchScope::Sessions) == 1);

/// Calls `f(C member, C++ member)` for every parameter.
template <typename CConfig, typename Config, typename Function>
void visit(CConfig& c, Config& p, Function f) {
  f(c.keyframe_scans, p.keyframe.scans);
  f(c.keyframe_distance_m, p.keyframe.distance_m);
  f(c.keyframe_range_min_m, p.keyframe.range_min_m);
  f(c.keyframe_range_max_m, p.keyframe.range_max_m);
  f(c.keyframe_downsample_leaf_m, p.keyframe.downsample_leaf_m);
  f(c.keyframe_max_pose_step_m, p.keyframe.max_pose_step_m);
  f(c.keyframe_max_speed_mps, p.keyframe.max_speed_mps);
  f(c.keyframe_max_points_per_scan, p.keyframe.max_points_per_scan);
  f(c.voxel_fine_size_m, p.voxel.fine_size_m);
  f(c.voxel_coarse_size_m, p.voxel.coarse_size_m);
  f(c.voxel_plane_max_eigenvalue_m2, p.voxel.plane_max_eigenvalue_m2);
  f(c.voxel_plane_min_points, p.voxel.plane_min_points);
  f(c.voxel_max_cells, p.voxel.max_cells);
  f(c.voxel_max_window_blocks, p.voxel.max_window_blocks);
  f(c.voxel_max_voxels, p.voxel.max_voxels);
  f(c.ground_max_tilt_deg, p.ground.max_tilt_deg);
  f(c.ground_margin_m, p.ground.margin_m);
  f(c.ground_below_depth_m, p.ground.below_depth_m);
  f(c.ground_own_plane_first, p.ground.own_plane_first);
  f(c.ground_elevated_step_m, p.ground.elevated_step_m);
  f(c.ground_elevated_reach_m, p.ground.elevated_reach_m);
  f(c.ground_seen_through_share, p.ground.seen_through_share);
  f(c.ground_propagation_voxels, p.ground.propagation_voxels);
  f(c.free_space_columns, p.free_space.columns);
  f(c.free_space_visibility, p.free_space.visibility);
  f(c.free_space_images_per_keyframe, p.free_space.images_per_keyframe);
  f(c.free_space_earlier_image_stride, p.free_space.earlier_image_stride);
  f(c.free_space_azimuth_resolution_deg, p.free_space.azimuth_resolution_deg);
  f(c.free_space_elevation_resolution_deg, p.free_space.elevation_resolution_deg);
  f(c.free_space_horizontal_fov_deg, p.free_space.horizontal_fov_deg);
  f(c.free_space_elevation_min_deg, p.free_space.elevation_min_deg);
  f(c.free_space_elevation_max_deg, p.free_space.elevation_max_deg);
  f(c.free_space_min_returns, p.free_space.min_returns);
  f(c.free_space_range_margin_m, p.free_space.range_margin_m);
  f(c.free_space_range_margin_relative, p.free_space.range_margin_relative);
  f(c.free_space_full_weight_range_m, p.free_space.full_weight_range_m);
  f(c.free_space_own_keyframe, p.free_space.own_keyframe);
  f(c.removal_window, p.removal.window);
  f(c.removal_candidates_next_to_ground, p.removal.candidates_next_to_ground);
  f(c.removal_log_odds_free, p.removal.log_odds_free);
  f(c.removal_log_odds_occupied, p.removal.log_odds_occupied);
  f(c.removal_log_odds_weakly_occupied, p.removal.log_odds_weakly_occupied);
  f(c.removal_components, p.removal.components);
  f(c.removal_connecting_height_m, p.removal.connecting_height_m);
  f(c.removal_component_dynamic_share, p.removal.component_dynamic_share);
  f(c.removal_component_static_share, p.removal.component_static_share);
  f(c.removal_confirmed_static_log_odds, p.removal.confirmed_static_log_odds);
  f(c.removal_log_odds_clamp, p.removal.log_odds_clamp);
  f(c.removal_persistence_share, p.removal.persistence_share);
  f(c.removal_final_labels, p.removal.final_labels);
  f(c.descriptor_voxel_size_m, p.descriptor.voxel_size_m);
  f(c.descriptor_max_cells, p.descriptor.max_cells);
  f(c.descriptor_max_voxels, p.descriptor.max_voxels);
  f(c.descriptor_max_keypoints, p.descriptor.max_keypoints);
  f(c.descriptor_max_planes, p.descriptor.max_planes);
  f(c.descriptor_range_m, p.descriptor.range_m);
  f(c.descriptor_column_size_m, p.descriptor.column_size_m);
  f(c.descriptor_min_height_m, p.descriptor.min_height_m);
  f(c.descriptor_window_m, p.descriptor.window_m);
  f(c.descriptor_suppression_radius_m, p.descriptor.suppression_radius_m);
  f(c.descriptor_max_candidates, p.descriptor.max_candidates);
  f(c.descriptor_plane_min_cells, p.descriptor.plane_min_cells);
  f(c.descriptor_plane_max_variance_m2, p.descriptor.plane_max_variance_m2);
  f(c.loop_search_max_places, p.loop_search.max_places);
  f(c.loop_search_max_results, p.loop_search.max_results);
  f(c.loop_search_max_keypoints, p.loop_search.max_keypoints);
  f(c.loop_search_max_planes, p.loop_search.max_planes);
  f(c.loop_search_voxel_size_m, p.loop_search.voxel_size_m);
  f(c.loop_search_side_tolerance_m, p.loop_search.side_tolerance_m);
  f(c.loop_search_dot_tolerance, p.loop_search.dot_tolerance);
  f(c.loop_search_max_code_difference, p.loop_search.max_code_difference);
  f(c.loop_search_max_bucket, p.loop_search.max_bucket);
  f(c.loop_search_max_compared, p.loop_search.max_compared);
  f(c.loop_search_max_matches, p.loop_search.max_matches);
  f(c.loop_search_max_candidates, p.loop_search.max_candidates);
  f(c.loop_search_max_per_session, p.loop_search.max_per_session);
  f(c.loop_search_max_verified, p.loop_search.max_verified);
  f(c.loop_search_inlier_distance_m, p.loop_search.inlier_distance_m);
  f(c.loop_search_min_inliers, p.loop_search.min_inliers);
  f(c.loop_search_max_tilt_rad, p.loop_search.max_tilt_rad);
  f(c.loop_search_accept_confidence, p.loop_search.accept_confidence);
  f(c.triangle_neighbours, p.loop_search.triangles.neighbours);
  f(c.triangle_min_side_m, p.loop_search.triangles.min_side_m);
  f(c.triangle_max_side_m, p.loop_search.triangles.max_side_m);
  f(c.triangle_min_height_m, p.loop_search.triangles.min_height_m);
  f(c.triangle_max_triangles, p.loop_search.triangles.max_triangles);
  f(c.search_sessions, p.search_scope.sessions);
  f(c.search_min_keyframe_gap, p.search_scope.min_keyframe_gap);
  f(c.budget_us, p.budget_us);
}

/// Copies C to C++; remembers a switch or choice that is none.
struct FromC {
  bool& all_possible;
  void operator()(float c, float& p) const noexcept { p = c; }
  void operator()(std::uint32_t c, std::uint32_t& p) const noexcept { p = c; }
  void operator()(std::uint32_t c, bool& p) const noexcept {
    all_possible = all_possible && c <= 1;
    p = c != 0;
  }
  void operator()(std::uint32_t c, SearchScope::Sessions& p) const noexcept {
    all_possible = all_possible && c <= 2;
    p = static_cast<SearchScope::Sessions>(c & 3U);
  }
};

}  // namespace

bool is_config_size(std::size_t struct_size) noexcept {
  return struct_size >= kHeaderBytes && struct_size <= sizeof(um_config) &&
         struct_size % sizeof(std::uint32_t) == 0;
}

um_status preset_config(std::uint32_t sensor, std::uint32_t computer, um_config& out) noexcept {
  if (sensor >= sensor_models().size()) return UM_UNKNOWN_SENSOR;
  if (computer > UM_COMPUTER_ARMV7_WITH_64_MB) return UM_UNKNOWN_COMPUTER;
  const PipelineConfig config =
      preset(static_cast<SensorKind>(sensor), static_cast<Computer>(computer));
  std::memset(&out, 0, sizeof out);
  out.struct_size = sizeof out;
  out.sensor = sensor;
  out.computer = computer;
  visit(out, config,
        [](auto& c, const auto& p) { c = static_cast<std::remove_reference_t<decltype(c)>>(p); });
  return UM_OK;
}

ConfigVerdict read_config(const um_config* config, PipelineConfig& out, um_config& full) noexcept {
  if (config == nullptr) return {UM_NULL_ARGUMENT, um_status_text(UM_NULL_ARGUMENT)};
  if (!is_config_size(config->struct_size)) {
    return {UM_UNKNOWN_VERSION,
            "config.struct_size is no size of um_config that this library knows: call "
            "um_config_init first, or link a newer library"};
  }
  switch (preset_config(config->sensor, config->computer, full)) {
    case UM_UNKNOWN_SENSOR:
      return {UM_UNKNOWN_SENSOR, "config.sensor must be one of enum um_sensor"};
    case UM_UNKNOWN_COMPUTER:
      return {UM_UNKNOWN_COMPUTER, "config.computer must be one of enum um_computer"};
    default:
      break;
  }
  std::memcpy(&full, config, config->struct_size);
  if (full.reserved[0] != 0 || full.reserved[1] != 0 || full.reserved[2] != 0)
    return {UM_INVALID_CONFIG, "config.reserved must be 0"};
  out = {};
  bool all_possible = true;
  visit(full, out, FromC{all_possible});
  if (!all_possible) {
    return {UM_INVALID_CONFIG,
            "config: switches must be 0 or 1 and search_sessions must be 0, 1 or 2"};
  }
  constexpr std::uint32_t kMostEvents = 1U << 20U;
  if (full.event_capacity > kMostEvents || (full.event_capacity & (full.event_capacity - 1)) != 0) {
    return {UM_INVALID_CONFIG, "config.event_capacity must be 0 or a power of two up to 2^20"};
  }
  out.clock_ns = full.clock_ns;
  const Error error = out.validate();
  if (error.code != ErrorCode::kOk) return {UM_INVALID_CONFIG, error.message};
  return {};
}

}  // namespace unimapper::c
