// Parameters of the merger, one struct per stage.
#pragma once

#include <cstdint>
#include <string>

#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::merge {

/// How odometry drifts: a random walk over the distance travelled. The defaults fit
/// LiDAR(-inertial) odometry of middling quality (5 cm and 0.1 degrees per 5 m); worse odometry
/// needs larger ones.
struct OdometryNoiseConfig {
  double translation_floor_m = 0.02;        ///< of any two keyframes, [0.001, 10]
  double translation_m_per_sqrt_m = 0.02;   ///< growth, [0.0001, 10]
  double rotation_floor_rad = 0.001;        ///< of any two keyframes, [0.00001, 1]
  double rotation_rad_per_sqrt_m = 0.0008;  ///< growth, [0.000001, 1]
};

/// Registration clouds and G-ICP (paper section VI, refined registration).
struct RegistrationConfig {
  float leaf_m = 0.4F;           ///< spacing of registration points, [0.05, 5]
  std::uint32_t neighbors = 12;  ///< points a covariance is taken from, [5, 64]
  /// Neighbours before and after a keyframe that may join its cloud, [0, 10] ...
  std::uint32_t submap_keyframes = 2;
  std::uint32_t submap_cells = 60000;  ///< ... until it holds so many cells, [0, 10000000]
  std::uint32_t max_points = 12000;    ///< the leaf grows until a cloud is smaller, [100, 1000000]
  std::uint32_t max_source_points = 4000;  ///< points of a source that are aligned, [100, 1000000]
  float submap_radius_m = 50.0F;  ///< points farther from the keyframe are left out, [5, 300]
  float coarse_correspondence_m = 2.5F;  ///< gate of the first stage, [0.1, 20]
  float fine_correspondence_m = 1.0F;    ///< gate of the last stage, [0.1, 20]
  std::uint32_t max_iterations = 24;     ///< of both stages together, [1, 200]
  double plane_sigma_m = 0.03;           ///< thickness of a surface, [0.001, 1]
  /// Neighbouring points repeat each other's errors: so many count as one observation, [1, 1000].
  double correlated_points = 30.0;
  double sigma_floor_m = 0.08;     ///< no loop is known better than this, [0.001, 10]
  double sigma_floor_rad = 0.006;  ///< the same for rotation, [0.0001, 1]
};

/// Where loop candidates come from and when geometry confirms one.
struct LoopConfig {
  std::uint32_t min_keyframe_gap = 15;        ///< within a session, [1, 1000]
  double min_path_gap_m = 20.0;               ///< within a session, [0, 1000]
  std::uint32_t candidates_per_keyframe = 3;  ///< verified per keyframe and other session, [1, 32]
  std::uint32_t max_candidates_per_pair = 200;  ///< verified per pair of sessions, [1, 5000]
  double max_tilt_rad = 0.09;                   ///< gravity gate: both frames are level, [0.01, 1]
  double min_initial_overlap = 0.3;             ///< before G-ICP is tried, [0, 1]
  double min_overlap = 0.45;                    ///< of structure (no ground) after G-ICP, [0, 1]
  double max_rmse_m = 0.35;                     ///< of matched points after G-ICP, [0.01, 5]
  double max_contradiction = 0.5;               ///< points inside the other's free space, [0, 1]
  double max_correction_m = 4.0;                ///< G-ICP against the descriptor's pose, [0.1, 50]
  double max_correction_rad = 0.25;             ///< the same for rotation, [0.01, 3.2]
};

/// Acceptance of inter-session loops (docs/design/loop-acceptance.md).
struct AcceptanceConfig {
  double consistency_chi2 = 16.81;     ///< 99 % of chi square with 6 degrees of freedom, [1, 200]
  std::uint32_t min_loops = 3;         ///< distinct loops that connect two maps, [2, 100]
  double min_span_m = 20.0;            ///< path they span in both maps, [0, 1000]
  std::uint32_t min_strong_loops = 2;  ///< enough when all overlap strongly, [2, 100]
  double strong_overlap = 0.7;         ///< what strongly means, [0, 1]
  double margin = 2.0;                 ///< best cluster over second disjoint one, [1, 100]
  double distinct_m = 2.0;  ///< loops closer than this along both paths are one, [0, 100]
  double loop_chi2 = 22.5;  ///< a loop beyond this after the solve is demoted, [1, 1000]
};

/// Pose graph optimisation.
struct GraphConfig {
  double cauchy_scale = 3.5;  ///< xi of the paper's kernel on whitened residuals, [0.1, 1000]
  std::uint32_t max_iterations = 60;  ///< [1, 1000]
  double deformation_floor_m =
      1.0;  ///< change of a committed map that is always plausible, [0, 100]
  double deformation_per_m = 0.005;  ///< and its growth along the path, [0, 1]
};

/// Radius search between aligned maps (paper section VI, equation for R).
struct RadiusConfig {
  double radius_m = 10.0;            ///< r_th, [0.5, 100]
  double spacing_m = 4.0;            ///< path between keyframes that are searched for, [0, 100]
  std::uint32_t per_keyframe = 1;    ///< loops per keyframe and other session, [1, 16]
  double max_correction_m = 3.0;     ///< G-ICP against the graph's pose, [0.1, 50]
  double max_correction_rad = 0.15;  ///< the same for rotation, [0.01, 3.2]
};

/// Refinement of static and dynamic cells; log-odds of "dynamic" as onboard (paper section
/// IV-D, docs/tuning.md).
struct RefinementConfig {
  std::uint32_t window = 10;  ///< keyframes before and after one that observe it; 0: off, [0, 100]
  std::uint32_t revisits = 10;  ///< others, of any session, that observe it too, [0, 1000]
  float reach_m = 30.0F;        ///< these are at most so far from it, [1, 500]
  float log_odds_free =
      EvidenceDefaults::kLogOddsFree;  ///< seen through by another keyframe, [0, 10]
  float log_odds_occupied =
      EvidenceDefaults::kLogOddsOccupied;  ///< occupied in another keyframe, [0, 10]
  float log_odds_weakly_occupied =
      EvidenceDefaults::kLogOddsWeaklyOccupied;            ///< a surface about there, [0, 10]
  float prior_log_odds = EvidenceDefaults::kPriorLogOdds;  ///< labelled dynamic online, [0, 10]
  float most_by_revisits = 1.0F;  ///< all revisits together, either way, [0, 10]
  float range_margin_m =
      EvidenceDefaults::kRangeMarginM;  ///< farther behind a cell: it was seen through, [0.05, 5]
  float range_margin_relative =
      EvidenceDefaults::kRangeMarginRelative;  ///< plus this share of the range, [0, 0.2]
  float connecting_height_m =
      EvidenceDefaults::kConnectingHeightM;  ///< lower cells connect no components, above ground,
                                             ///< [0, 2]
  float component_dynamic_share = 0.4F;      ///< at least: all of a component is dynamic, [0, 1]
  float component_static_share =
      EvidenceDefaults::kComponentStaticShare;  ///< less: all of it is static, [0, 1]
  float confirmed_static_log_odds =
      EvidenceDefaults::kConfirmedStaticLogOdds;  ///< a cell counts no more than this; static
                                                  ///< beyond stays, (0, 1000]
  float ground_log_odds = 1.0F;  ///< ground counts as seen through from here on, [0, 10]
  float ground_share = EvidenceDefaults::kSeenThroughShare;  ///< and such a patch is none: share of
                                                             ///< its cells, (0, 1]
};

/// The unified map and what changed between sessions.
struct MapConfig {
  float voxel_size_m = 0.2F;        ///< of the map, [0.05, 5]
  float tree_voxel_size_m = 2.0F;   ///< one kd-tree each, [0.5, 50]
  float change_distance_m = 0.5F;   ///< nearest point of the other session farther away, [0.1, 2]
  float change_range_m = 30.0F;     ///< how far a keyframe observes free space, [5, 200]
  float free_margin_m = 0.6F;       ///< how far in front of a surface is free, [0.1, 5]
  std::uint32_t min_witnesses = 2;  ///< keyframes that saw the place free, [1, 100]
  std::uint32_t min_cluster = 6;  ///< changed points within a metre of one that is kept, [1, 1000]
};

/// Parameters of the merger.
struct MergeConfig {
  OdometryNoiseConfig odometry;
  RegistrationConfig registration;
  LoopConfig loops;
  AcceptanceConfig acceptance;
  GraphConfig graph;
  RadiusConfig radius;
  RefinementConfig refinement;
  MapConfig map;
  std::uint32_t threads = 0;  ///< 0: as many as the machine has; the result is the same

  /// Empty, or what is wrong in words.
  [[nodiscard]] std::string validate() const;
};

}  // namespace unimapper::merge
