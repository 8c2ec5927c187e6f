#include "unimapper/place/config.hpp"

namespace unimapper {
namespace {

constexpr Error invalid(const char* message) noexcept {
  return {ErrorCode::kInvalidConfig, message};
}

// False for NaN too.
template <typename T>
constexpr bool within(T value, T low, T high) noexcept {
  return value >= low && value <= high;
}

Error validate_triangles(const TriangleConfig& config) noexcept {
  if (!within(config.neighbours, 2U, 32U)) {
    return invalid("triangles.neighbours must be between 2 and 32");
  }
  if (!within(config.min_side_m, 0.5F, 20.0F)) {
    return invalid("triangles.min_side_m must be between 0.5 and 20 metres");
  }
  if (!within(config.max_side_m, config.min_side_m, 300.0F)) {
    return invalid("triangles.max_side_m must be between triangles.min_side_m and 300 metres");
  }
  if (!within(config.min_height_m, 0.1F, 10.0F)) {
    return invalid("triangles.min_height_m must be between 0.1 and 10 metres");
  }
  if (!within(config.max_triangles, 16U, 20000U)) {
    return invalid("triangles.max_triangles must be between 16 and 20000");
  }
  return {};
}

}  // namespace

Error DescriptorConfig::validate() const noexcept {
  if (!within(voxel_size_m, 0.5F, 8.0F)) {
    return invalid("descriptor.voxel_size_m must be between 0.5 and 8 metres");
  }
  if (!within(max_cells, 1U, 1U << 22U)) {
    return invalid("descriptor.max_cells must be between 1 and 4194304");
  }
  if (!within(max_voxels, 1U, 1U << 20U)) {
    return invalid("descriptor.max_voxels must be between 1 and 1048576");
  }
  if (!within(max_keypoints, 8U, 255U)) {
    return invalid("descriptor.max_keypoints must be between 8 and 255");
  }
  if (!within(max_planes, 1U, 65535U)) {
    return invalid("descriptor.max_planes must be between 1 and 65535");
  }
  if (!within(range_m, 10.0F, 120.0F)) {
    return invalid("descriptor.range_m must be between 10 and 120 metres");
  }
  if (!within(column_size_m, 0.2F, 1.0F)) {
    return invalid("descriptor.column_size_m must be between 0.2 and 1 metre");
  }
  if (!within(min_height_m, 0.0F, 3.0F)) {
    return invalid("descriptor.min_height_m must be between 0 and 3 metres");
  }
  if (!within(window_m, 0.2F, 1.0F)) {
    return invalid("descriptor.window_m must be between 0.2 and 1 metre");
  }
  if (!within(suppression_radius_m, 0.5F, 10.0F)) {
    return invalid("descriptor.suppression_radius_m must be between 0.5 and 10 metres");
  }
  if (!within(max_candidates, max_keypoints, 65535U)) {
    return invalid("descriptor.max_candidates must be between max_keypoints and 65535");
  }
  if (!within(plane_min_cells, 4U, 1000U)) {
    return invalid("descriptor.plane_min_cells must be between 4 and 1000");
  }
  if (!(plane_max_variance_m2 > 0.0F && plane_max_variance_m2 <= 1.0F)) {
    return invalid("descriptor.plane_max_variance_m2 must be above 0 and at most 1 square metre");
  }
  return {};
}

Error LoopSearchConfig::validate() const noexcept {
  if (!within(max_places, 1U, 1U << 20U)) {
    return invalid("loop_search.max_places must be between 1 and 1048576");
  }
  if (!within(max_results, 1U, 256U)) {
    return invalid("loop_search.max_results must be between 1 and 256");
  }
  if (!within(max_keypoints, 8U, 255U)) {
    return invalid("loop_search.max_keypoints must be between 8 and 255");
  }
  if (!within(max_planes, 1U, 65535U)) {
    return invalid("loop_search.max_planes must be between 1 and 65535");
  }
  if (!within(voxel_size_m, 0.5F, 8.0F)) {
    return invalid("loop_search.voxel_size_m must be between 0.5 and 8 metres");
  }
  if (!within(side_tolerance_m, 0.05F, 1.2F)) {
    return invalid("loop_search.side_tolerance_m must be between 0.05 and 1.2 metres");
  }
  if (!within(dot_tolerance, 0.0F, 1.0F)) {
    return invalid("loop_search.dot_tolerance must be between 0 and 1");
  }
  if (max_code_difference > 24U) {
    return invalid("loop_search.max_code_difference must be between 0 and 24");
  }
  if (!within(max_bucket, 5U, 1U << 24U)) {
    return invalid("loop_search.max_bucket must be between 5 and 16777216");
  }
  if (!within(max_compared, 1000U, 1U << 30U)) {
    return invalid("loop_search.max_compared must be between 1000 and 1073741824");
  }
  if (!within(max_matches, 64U, 1U << 24U)) {
    return invalid("loop_search.max_matches must be between 64 and 16777216");
  }
  if (!within(max_candidates, 1U, 256U)) {
    return invalid("loop_search.max_candidates must be between 1 and 256");
  }
  if (max_per_session > 256U) {
    return invalid("loop_search.max_per_session must be between 0 and 256");
  }
  if (!within(max_verified, 1U, 256U)) {
    return invalid("loop_search.max_verified must be between 1 and 256");
  }
  if (!within(inlier_distance_m, 0.2F, 3.0F)) {
    return invalid("loop_search.inlier_distance_m must be between 0.2 and 3 metres");
  }
  if (!within(min_inliers, 3U, 255U)) {
    return invalid("loop_search.min_inliers must be between 3 and 255");
  }
  if (!(max_tilt_rad > 0.0F && max_tilt_rad <= 0.5F)) {
    return invalid("loop_search.max_tilt_rad must be above 0 and at most 0.5 radians");
  }
  if (!within(accept_confidence, 0.0F, 1.0F)) {
    return invalid("loop_search.accept_confidence must be between 0 and 1");
  }
  return validate_triangles(triangles);
}

}  // namespace unimapper
