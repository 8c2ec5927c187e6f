// Parameters of description and loop search.
#pragma once

#include <cstdint>

#include "unimapper/core/expected.hpp"

namespace unimapper {

/// Parameters of `PlaceDescriber` (paper section V-A).
struct DescriptorConfig {
  float voxel_size_m = 2.0F;             ///< coarse voxels L_c, [0.5, 8] (paper)
  std::uint32_t max_cells = 1U << 17U;   ///< static cells of one keyframe, [1, 2^22]
  std::uint32_t max_voxels = 1U << 14U;  ///< coarse voxels of one keyframe, [1, 2^20]
  std::uint32_t max_keypoints = 128;     ///< kept keypoints, [8, 255]
  std::uint32_t max_planes = 1024;       ///< kept plane patches, [1, 65535]

  /// Only cells within this horizontal distance of the keyframe's origin are described, [10, 120].
  float range_m = 50.0F;
  /// Grid step of the map of vertical structure, [0.2, 1]. About 1.5 L_f.
  float column_size_m = 0.3F;
  /// Structure lower than this above the local ground is ignored (kerbs, grass), [0, 3].
  float min_height_m = 0.3F;
  /// Neighbourhood over which a corner is judged, standard deviation, [0.2, 1].
  float window_m = 0.7F;
  /// No two keypoints lie closer than this, [0.5, 10]. STD: 2 m.
  float suppression_radius_m = 2.0F;
  /// Corner candidates considered before suppression, [max_keypoints, 65535].
  std::uint32_t max_candidates = 4096;
  /// A coarse voxel with at least so many cells may be a plane, [4, 1000].
  std::uint32_t plane_min_cells = 10;
  /// Largest variance of a plane's cells along its normal, square metres, (0, 1]. STD: 0.01.
  float plane_max_variance_m2 = 0.01F;

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

/// Which triangles are formed from the keypoints of a place.
struct TriangleConfig {
  std::uint32_t neighbours = 12;  ///< every keypoint pairs up its k nearest, [2, 32]. STD: 10-20
  float min_side_m = 4.0F;        ///< shortest side, [0.5, 20]
  float max_side_m = 40.0F;       ///< longest side, (min_side_m, 300]
  float min_height_m = 1.0F;      ///< flatter triangles have no reliable orientation, [0.1, 10]
  std::uint32_t max_triangles = 500;  ///< per place, [16, 20000]
};

/// Parameters of `PlaceDatabase` (paper section V-B).
struct LoopSearchConfig {
  std::uint32_t max_places = 2000;    ///< stored keyframes, [1, 2^20]
  std::uint32_t max_results = 8;      ///< candidates returned per search, [1, 256]
  std::uint32_t max_keypoints = 128;  ///< per place, as in DescriptorConfig
  std::uint32_t max_planes = 2048;    ///< per place, as in DescriptorConfig

  float voxel_size_m = 2.0F;  ///< of the planes, as in DescriptorConfig
  TriangleConfig triangles;
  /// Two sides are equal within this; absolute, because it comes from the keypoints' noise and
  /// not from the side's length, [0.05, 1.2].
  float side_tolerance_m = 0.2F;
  float dot_tolerance = 0.35F;  ///< two normal products are equal within this, [0, 1]
  /// Bands of height in which the columns at the three vertices may differ, of 24 (see
  /// `column_sketch`), [0, 24].
  std::uint32_t max_code_difference = 6;
  std::uint32_t max_bucket = 4096;  ///< triangles kept in one hash bucket, [5, 2^24]
  /// Stored triangles a search compares: bounds its time however many places there are. Beyond, the
  /// query's triangles of farther neighbours are left out, [1000, 2^30].
  std::uint32_t max_compared = 220000;
  std::uint32_t max_matches = 1U << 16U;  ///< matched triangles kept per search, [64, 2^24]
  std::uint32_t max_candidates = 32;      ///< poses examined after voting, [1, 256]
  /// Of these, at most so many in one session, so that one that resembles everything does not keep
  /// the others out; 0: no limit, [0, 256].
  std::uint32_t max_per_session = 0;
  std::uint32_t max_verified = 4;  ///< candidates whose planes are compared, [1, 256]
  float inlier_distance_m = 0.8F;  ///< keypoints that agree with a pose, [0.2, 3]
  std::uint32_t min_inliers = 5;   ///< fewer are no hypothesis, [3, 255]
  float max_tilt_rad = 0.09F;      ///< roll and pitch between levelled frames, (0, 0.5]
  /// Candidates that are right with at least this probability are accepted, [0, 1].
  float accept_confidence = 0.97F;

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

}  // namespace unimapper
