#include "unimapper/merge/merge_config.hpp"

#include <cstdio>

namespace unimapper::merge {
namespace {

struct Range {
  template <typename Number>
  Range(const char* member, Number number, double lowest, double highest)
      : name(member), value(static_cast<double>(number)), low(lowest), high(highest) {}

  const char* name;
  double value;
  double low;
  double high;
};

}  // namespace

std::string MergeConfig::validate() const {
  const Range ranges[] = {
      {"odometry.translation_floor_m", odometry.translation_floor_m, 0.001, 10.0},
      {"odometry.translation_m_per_sqrt_m", odometry.translation_m_per_sqrt_m, 0.0001, 10.0},
      {"odometry.rotation_floor_rad", odometry.rotation_floor_rad, 0.00001, 1.0},
      {"odometry.rotation_rad_per_sqrt_m", odometry.rotation_rad_per_sqrt_m, 0.000001, 1.0},
      {"registration.leaf_m", registration.leaf_m, 0.05, 5.0},
      {"registration.neighbors", registration.neighbors, 5, 64},
      {"registration.submap_keyframes", registration.submap_keyframes, 0, 10},
      {"registration.submap_cells", registration.submap_cells, 0, 10000000},
      {"registration.max_points", registration.max_points, 100, 1000000},
      {"registration.max_source_points", registration.max_source_points, 100, 1000000},
      {"registration.submap_radius_m", registration.submap_radius_m, 5.0, 300.0},
      {"registration.coarse_correspondence_m", registration.coarse_correspondence_m, 0.1, 20.0},
      {"registration.fine_correspondence_m", registration.fine_correspondence_m, 0.1, 20.0},
      {"registration.max_iterations", registration.max_iterations, 1, 200},
      {"registration.plane_sigma_m", registration.plane_sigma_m, 0.001, 1.0},
      {"registration.correlated_points", registration.correlated_points, 1.0, 1000.0},
      {"registration.sigma_floor_m", registration.sigma_floor_m, 0.001, 10.0},
      {"registration.sigma_floor_rad", registration.sigma_floor_rad, 0.0001, 1.0},
      {"loops.min_keyframe_gap", loops.min_keyframe_gap, 1, 1000},
      {"loops.min_path_gap_m", loops.min_path_gap_m, 0.0, 1000.0},
      {"loops.candidates_per_keyframe", loops.candidates_per_keyframe, 1, 32},
      {"loops.max_candidates_per_pair", loops.max_candidates_per_pair, 1, 5000},
      {"loops.max_tilt_rad", loops.max_tilt_rad, 0.01, 1.0},
      {"loops.min_initial_overlap", loops.min_initial_overlap, 0.0, 1.0},
      {"loops.min_overlap", loops.min_overlap, 0.0, 1.0},
      {"loops.max_rmse_m", loops.max_rmse_m, 0.01, 5.0},
      {"loops.max_contradiction", loops.max_contradiction, 0.0, 1.0},
      {"loops.max_correction_m", loops.max_correction_m, 0.1, 50.0},
      {"loops.max_correction_rad", loops.max_correction_rad, 0.01, 3.2},
      {"acceptance.consistency_chi2", acceptance.consistency_chi2, 1.0, 200.0},
      {"acceptance.min_loops", acceptance.min_loops, 2, 100},
      {"acceptance.min_span_m", acceptance.min_span_m, 0.0, 1000.0},
      {"acceptance.min_strong_loops", acceptance.min_strong_loops, 2, 100},
      {"acceptance.strong_overlap", acceptance.strong_overlap, 0.0, 1.0},
      {"acceptance.margin", acceptance.margin, 1.0, 100.0},
      {"acceptance.distinct_m", acceptance.distinct_m, 0.0, 100.0},
      {"acceptance.loop_chi2", acceptance.loop_chi2, 1.0, 1000.0},
      {"graph.cauchy_scale", graph.cauchy_scale, 0.1, 1000.0},
      {"graph.max_iterations", graph.max_iterations, 1, 1000},
      {"graph.deformation_floor_m", graph.deformation_floor_m, 0.0, 100.0},
      {"graph.deformation_per_m", graph.deformation_per_m, 0.0, 1.0},
      {"radius.radius_m", radius.radius_m, 0.5, 100.0},
      {"radius.spacing_m", radius.spacing_m, 0.0, 100.0},
      {"radius.per_keyframe", radius.per_keyframe, 1, 16},
      {"radius.max_correction_m", radius.max_correction_m, 0.1, 50.0},
      {"radius.max_correction_rad", radius.max_correction_rad, 0.01, 3.2},
      {"refinement.window", refinement.window, 0, 100},
      {"refinement.revisits", refinement.revisits, 0, 1000},
      {"refinement.reach_m", refinement.reach_m, 1.0, 500.0},
      {"refinement.log_odds_free", refinement.log_odds_free, 0.0, 10.0},
      {"refinement.log_odds_occupied", refinement.log_odds_occupied, 0.0, 10.0},
      {"refinement.log_odds_weakly_occupied", refinement.log_odds_weakly_occupied, 0.0, 10.0},
      {"refinement.prior_log_odds", refinement.prior_log_odds, 0.0, 10.0},
      {"refinement.most_by_revisits", refinement.most_by_revisits, 0.0, 10.0},
      {"refinement.range_margin_m", refinement.range_margin_m, 0.05, 5.0},
      {"refinement.range_margin_relative", refinement.range_margin_relative, 0.0, 0.2},
      {"refinement.connecting_height_m", refinement.connecting_height_m, 0.0, 2.0},
      {"refinement.component_dynamic_share", refinement.component_dynamic_share, 0.0, 1.0},
      {"refinement.component_static_share", refinement.component_static_share, 0.0, 1.0},
      {"refinement.confirmed_static_log_odds", refinement.confirmed_static_log_odds, 0.001, 1000.0},
      {"refinement.ground_log_odds", refinement.ground_log_odds, 0.0, 10.0},
      {"refinement.ground_share", refinement.ground_share, 0.001, 1.0},
      {"map.voxel_size_m", map.voxel_size_m, 0.05, 5.0},
      {"map.tree_voxel_size_m", map.tree_voxel_size_m, 0.5, 50.0},
      {"map.change_distance_m", map.change_distance_m, 0.1, 2.0},
      {"map.change_range_m", map.change_range_m, 5.0, 200.0},
      {"map.free_margin_m", map.free_margin_m, 0.1, 5.0},
      {"map.min_witnesses", map.min_witnesses, 1, 100},
      {"map.min_cluster", map.min_cluster, 1, 1000},
  };
  for (const Range& range : ranges) {
    if (range.value >= range.low * (1.0 - 1e-6) && range.value <= range.high * (1.0 + 1e-6)) {
      continue;
    }
    char text[160];
    std::snprintf(text, sizeof text, "%s is %g but must lie in [%g, %g]", range.name, range.value,
                  range.low, range.high);
    return text;
  }
  return {};
}

}  // namespace unimapper::merge
