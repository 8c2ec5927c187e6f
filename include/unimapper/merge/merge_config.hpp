// Parameters of the merger: one struct per stage, a table of its members behind each.
//
// docs/parameters.md prints the tables; include/unimapper/onboard/config.hpp says what the sources
// mean.
#pragma once

#include <concepts>
#include <cstdint>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/grid_size.hpp"
#include "unimapper/core/parameter_table.hpp"
#include "unimapper/core/tilt_prior.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::merge {

/// How odometry drifts: a random walk over the distance travelled. The defaults fit
/// LiDAR(-inertial) odometry of middling quality (5 cm and 0.1 degrees per 5 m); worse odometry
/// needs larger ones.
struct OdometryNoiseConfig {
  double translation_floor_m = 0.02;
  double translation_m_per_sqrt_m = 0.02;
  double rotation_floor_rad = 0.001;
  double rotation_rad_per_sqrt_m = 0.0008;
};

template <std::same_as<OdometryNoiseConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::translation_floor_m>(
          "[0.001, 10]", "m", "choice",
          "Standard deviation of the translation between any two keyframes, however near."),
      parameter<&C::translation_m_per_sqrt_m>(
          "[0.0001, 10]", "m/√m", "choice",
          "Growth of the translation's standard deviation with the square root of the path."),
      parameter<&C::rotation_floor_rad>(
          "[0.00001, 1]", "rad", "choice",
          "Standard deviation of the rotation between any two keyframes, however near."),
      parameter<&C::rotation_rad_per_sqrt_m>(
          "[0.000001, 1]", "rad/√m", "choice",
          "Growth of the rotation's standard deviation with the square root of the path."));
}

/// Registration clouds and G-ICP (paper section VI, refined registration).
struct RegistrationConfig {
  float leaf_m = 0.4F;
  std::uint32_t neighbors = 12;
  std::uint32_t submap_keyframes = 2;
  std::uint32_t submap_cells = 60000;
  std::uint32_t max_points = 12000;
  std::uint32_t max_source_points = 4000;
  float submap_radius_m = 50.0F;
  /// Largest correspondence distance of the first stage, metres.
  static constexpr float kCoarseCorrespondenceM = 2.5F;
  float fine_correspondence_m = 1.0F;
  std::uint32_t max_iterations = 24;
  double plane_sigma_m = 0.03;
  double correlated_points = 30.0;
  double sigma_floor_m = 0.08;
  double sigma_floor_rad = 0.006;
  /// So far along its weakest axis the registration of a loop is started again, either way, metres.
  static constexpr double kProbeM = 1.5;
  /// A loop says nothing along its weakest axis if a restart that fits ends farther off, metres.
  static constexpr double kProbeSlipM = 0.5;
};

template <std::same_as<RegistrationConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::leaf_m>("[0.05, 5]", "m", "choice", "Spacing of registration points."),
      parameter<&C::neighbors>("[5, 64]", "points", "choice",
                               "Points a covariance is estimated from."),
      parameter<&C::submap_keyframes>(
          "[0, 10]", "keyframes", "choice",
          "Neighbours before and after a keyframe that may join its cloud."),
      parameter<&C::submap_cells>(
          "[0, 10000000]", "cells", "choice",
          "A keyframe's cloud with so many cells takes no further neighbours."),
      parameter<&C::max_points>("[100, 1000000]", "points", "choice",
                                "The leaf grows until a cloud is smaller."),
      parameter<&C::max_source_points>("[100, 1000000]", "points", "choice",
                                       "Points of a source that are aligned."),
      parameter<&C::submap_radius_m>("[5, 300]", "m", "choice",
                                     "Points farther from the keyframe are left out."),
      parameter<&C::fine_correspondence_m>("[0.1, 20]", "m", "choice",
                                           "Largest correspondence distance of the last stage."),
      parameter<&C::max_iterations>("[1, 200]", "", "choice",
                                    "Iterations of both stages together."),
      parameter<&C::plane_sigma_m>("[0.001, 1]", "m", "choice",
                                   "Thickness of a surface, standard deviation."),
      parameter<&C::correlated_points>(
          "[1, 1000]", "points", "choice",
          "Neighbouring points repeat each other's errors: so many count as one observation."),
      parameter<&C::sigma_floor_m>("[0.001, 10]", "m", "choice",
                                   "Smallest standard deviation of a loop's translation."),
      parameter<&C::sigma_floor_rad>("[0.0001, 1]", "rad", "choice",
                                     "Smallest standard deviation of a loop's rotation."));
}

/// Where loop candidates come from and when their geometry is verified.
struct LoopConfig {
  std::uint32_t min_keyframe_gap = 15;
  double min_path_gap_m = 20.0;
  std::uint32_t candidates_per_keyframe = 3;
  std::uint32_t max_candidates_per_pair = 200;
  TiltConfig tilt;  ///< prior on the tilt between two keyframes, in search and verification
  double min_initial_overlap = 0.3;
  double min_overlap = 0.45;
  double max_rmse_m = 0.35;
  double max_contradiction = 0.5;
  double max_correction_m = 4.0;
  double max_correction_rad = 0.25;
};

template <std::same_as<LoopConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::min_keyframe_gap>(
          "[1, 1000]", "keyframes", "choice",
          "Least number of keyframes from one to the other of an intra-session loop."),
      parameter<&C::min_path_gap_m>(
          "[0, 1000]", "m", "choice",
          "Least path between the two keyframes of an intra-session loop."),
      parameter<&C::candidates_per_keyframe>("[1, 32]", "", "choice",
                                             "Candidates verified per keyframe and other session."),
      parameter<&C::max_candidates_per_pair>(
          "[1, 5000]", "", "choice",
          "Candidates verified per pair of sessions, spread over places."),
      parameters_in<&C::tilt>(),
      parameter<&C::min_initial_overlap>("[0, 1]", "", "choice",
                                         "Overlap of structure before G-ICP is tried."),
      parameter<&C::min_overlap>("[0, 1]", "", "choice",
                                 "Overlap of structure (no ground) after G-ICP; two thirds of it "
                                 "where the common view agrees."),
      parameter<&C::max_rmse_m>("[0.01, 5]", "m", "choice",
                                "Largest root mean square distance of matched points after G-ICP."),
      parameter<&C::max_contradiction>(
          "[0, 1]", "", "choice", "Share of the points that lie inside the other's free space."),
      parameter<&C::max_correction_m>("[0.1, 50]", "m", "choice",
                                      "Largest distance of G-ICP's pose from the descriptor's."),
      parameter<&C::max_correction_rad>("[0.01, 3.2]", "rad", "choice",
                                        "Largest rotation of G-ICP's pose from the descriptor's."));
}

/// When inter-session loops are accepted (docs/design/loop-acceptance.md).
struct AcceptanceConfig {
  double consistency_chi2 = 16.81;
  std::uint32_t min_loops = 3;
  double min_span_m = 20.0;
  std::uint32_t min_strong_loops = 2;
  /// Overlap of a loop, 0 to 1, from which on it is a strong one.
  static constexpr double kStrongOverlap = 0.7;
  double margin = 2.0;
  double sufficient_margin = 4.0;
  double distinct_m = 2.0;
  double place_span_m = 100.0;
  double vote_sigma_m = 1.0;
  /// Two loops within a session confirm each other if odometry between them is as sure (standard
  /// deviation, metres). Keyframes of two sessions are compared as far from a loop.
  static constexpr double kConfirmingSigmaM = 1.0;
  double full_extent_m = 40.0;
  /// Spans and distances of small maps shrink to no less than this share.
  static constexpr double kSmallestScale = 0.4;
  double loop_chi2 = 22.5;
};

template <std::same_as<AcceptanceConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::consistency_chi2>("[1, 200]", "",
                                      "99 % of chi square with 6 degrees of freedom",
                                      "Two loops are consistent up to this chi square."),
      parameter<&C::min_loops>("[2, 100]", "loops", "choice",
                               "Distinct loops that connect two maps."),
      parameter<&C::min_span_m>("[0, 1000]", "m", "choice",
                                "Path in both maps that the loops between them span."),
      parameter<&C::min_strong_loops>(
          "[2, 100]", "loops", "choice",
          "So many distinct loops are enough when all overlap strongly."),
      parameter<&C::margin>(
          "[1, 100]", "", "choice",
          "Consistency set over the largest competing set; below it the pair is provisional."),
      parameter<&C::sufficient_margin>("[1, 100]", "", "choice",
                                       "Consistency set over a competing set that alone would "
                                       "connect the maps; below it the pair is provisional."),
      parameter<&C::distinct_m>("[0, 100]", "m", "choice",
                                "Loops closer than this along either path count once."),
      parameter<&C::place_span_m>(
          "[0, 1000]", "m", "choice",
          "Loops within so short a path lie in one place, and one place may look like another: "
          "sensor data elsewhere must confirm them."),
      parameter<&C::vote_sigma_m>(
          "[0.01, 100]", "m", "choice",
          "A loop knows the position along a direction if its standard deviation is smaller."),
      parameter<&C::full_extent_m>(
          "[0, 1000]", "m", "measured",
          "Where keyframes of both maps see less far (radius within which 95 % of their static "
          "cells lie), min_span_m, distinct_m and place_span_m are shorter in proportion; 0: "
          "never."),
      parameter<&C::loop_chi2>("[1, 1000]", "", "choice",
                               "A loop beyond this after optimisation is rejected."));
}

/// Search for perceptual aliasing before two maps are merged.
struct AliasingConfig {
  /// To see whether a place repeats, loops are moved to keyframes of the same map at least so far
  /// away, metres.
  static constexpr double kMinShiftM = 4.0;
  double max_shift_m = 60.0;
  double alike_share = 0.8;
  /// A place is below a ceiling if this share of its ground has structure above it.
  static constexpr double kRoofedShare = 0.5;
  double changed_share = 0.08;
};

template <std::same_as<AliasingConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::max_shift_m>(
          "[1, 1000]", "m", "measured",
          "Loops are moved to keyframes of the same map at most so far away."),
      parameter<&C::alike_share>("[0.1, 2]", "", "measured",
                                 "They fit there as well if of the structure facing the shift this "
                                 "share coincides, of what coincides here."),
      parameter<&C::changed_share>(
          "[0, 1]", "", "measured",
          "A place below a ceiling may be another storey if this share of the structure lies in "
          "the other's free space, "
          "and the geometric mean of that and of what stands in one session alone is as large."));
}

/// Known positions of keyframes (docs/design/known-positions.md).
struct PositionConfig {
  double chi2 = 16.27;
  /// How well the map's up is known without positions, radians.
  static constexpr double kUpSigmaRad = 0.01;
  double heading_sigma_rad = 0.1;
  /// Storeys are at least so far above each other, metres: heights that are known better say which
  /// one it is.
  static constexpr double kStoreyM = 2.2;
};

template <std::same_as<PositionConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::chi2>("[1, 1000]", "", "99.9 % of chi square with 3 degrees of freedom",
                          "A position, and a loop between sessions with positions, agrees with the "
                          "others up to this chi square."),
      parameter<&C::heading_sigma_rad>("[0.001, 3]", "rad", "choice",
                                       "The heading counts as known from positions up to this "
                                       "standard deviation."));
}

/// Pose graph optimisation.
struct GraphConfig {
  double cauchy_scale = 3.5;
  std::uint32_t max_iterations = 60;
  double deformation_floor_m = 1.0;
  double deformation_per_m = 0.005;
};

template <std::same_as<GraphConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::cauchy_scale>("[0.1, 1000]", "", "paper",
                                  "xi of the paper's kernel, on whitened residuals."),
      parameter<&C::max_iterations>("[1, 1000]", "", "choice", "Iterations of one solve."),
      parameter<&C::deformation_floor_m>("[0, 100]", "m", "choice",
                                         "Deformation of a session that is always plausible."),
      parameter<&C::deformation_per_m>(
          "[0, 1]", "m/m", "choice",
          "Growth of a session's plausible deformation along its path."));
}

/// Radius search between aligned maps (paper section VI, equation for R).
struct RadiusConfig {
  double radius_m = 10.0;
  double spacing_m = 4.0;
  std::uint32_t per_keyframe = 1;
  double max_correction_m = 3.0;
  double max_correction_rad = 0.15;
};

template <std::same_as<RadiusConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::radius_m>("[0.5, 100]", "m", "paper",
                              "r_th: radius within which keyframes are searched for."),
      parameter<&C::spacing_m>("[0, 100]", "m", "choice",
                               "Path between keyframes that are searched for."),
      parameter<&C::per_keyframe>("[1, 16]", "loops", "choice",
                                  "Loops per keyframe and other session."),
      parameter<&C::max_correction_m>("[0.1, 50]", "m", "choice",
                                      "Largest distance of G-ICP's pose from the graph's."),
      parameter<&C::max_correction_rad>("[0.01, 3.2]", "rad", "choice",
                                        "Largest rotation of G-ICP's pose from the graph's."));
}

/// What is static, decided again with later evidence; log-odds of "dynamic" as onboard (paper
/// section IV-D, docs/tuning.md).
struct RefinementConfig {
  std::uint32_t window = 10;
  std::uint32_t revisits = 10;
  float reach_m = 30.0F;
  float log_odds_free = EvidenceDefaults::kLogOddsFree;
  float log_odds_occupied = EvidenceDefaults::kLogOddsOccupied;
  float log_odds_weakly_occupied = EvidenceDefaults::kLogOddsWeaklyOccupied;
  float prior_log_odds = EvidenceDefaults::kPriorLogOdds;
  float most_by_revisits = 1.0F;
  float range_margin_m = EvidenceDefaults::kRangeMarginM;
  float range_margin_relative = EvidenceDefaults::kRangeMarginRelative;
  float connecting_height_m = EvidenceDefaults::kConnectingHeightM;
  float component_dynamic_share = 0.4F;
  float component_static_share = EvidenceDefaults::kComponentStaticShare;
  float confirmed_static_log_odds = EvidenceDefaults::kConfirmedStaticLogOdds;
  std::uint32_t moved_part_cells = 30;
  float moved_part_log_odds = 0.3F;
  float moved_part_occupied = 0.5F;
  float ground_log_odds = 1.0F;
  float ground_share = EvidenceDefaults::kSeenThroughShare;
  float cell_size_m = kFineCellSizeM;
};

template <std::same_as<RefinementConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::window>(
          "[0, 100]", "keyframes", "measured",
          "Keyframes before and after one whose evidence is used; 0: no refinement."),
      parameter<&C::revisits>("[0, 1000]", "keyframes", "measured",
                              "Most keyframes of any session, outside the window, whose evidence "
                              "is used: the nearest."),
      parameter<&C::reach_m>("[1, 500]", "m", "measured",
                             "Keyframes outside the window are used within this distance."),
      parameter<&C::log_odds_free>(
          "[0, 10]", "", "as onboard",
          "Log-odds of a cell seen through by an image of another keyframe."),
      parameter<&C::log_odds_occupied>("[0, 10]", "", "as onboard",
                                       "Log-odds of a cell observed by another keyframe."),
      parameter<&C::log_odds_weakly_occupied>("[0, 10]", "", "as onboard",
                                              "Log-odds of a surface observed close to the cell."),
      parameter<&C::prior_log_odds>("[0, 10]", "", "measured",
                                    "Log-odds of a cell that the robot labelled dynamic."),
      parameter<&C::most_by_revisits>("[0, 10]", "", "measured",
                                      "Largest log-odds of all revisits together, either way."),
      parameter<&C::range_margin_m>("[0.05, 5]", "m", "as onboard",
                                    "A cell is seen through if the image's range exceeds the "
                                    "cell's by this and range_margin_relative."),
      parameter<&C::range_margin_relative>(
          "[0, 0.2]", "", "as onboard", "Share of a cell's range that is added to range_margin_m."),
      parameter<&C::connecting_height_m>(
          "[0, 2]", "m", "as onboard",
          "Cells lower than this above the ground connect no components."),
      parameter<&C::component_dynamic_share>("[0, 1]", "", "measured",
                                             "A component is dynamic if the evidence around at "
                                             "least this share of its cells says so."),
      parameter<&C::component_static_share>("[0, 1]", "", "measured",
                                            "A component is static if the evidence around less "
                                            "than this share of its cells says dynamic."),
      parameter<&C::confirmed_static_log_odds>(
          "[0.001, 1000]", "", "as onboard",
          "A cell counts no more than this; below minus this it stays static."),
      parameter<&C::moved_part_cells>("[1, 1000000]", "cells", "measured",
                                      "Least number of connected cells seen through that are "
                                      "dynamic within a static component: a moved part."),
      parameter<&C::moved_part_log_odds>("[-10, 10]", "", "measured",
                                         "Least log-odds of a moved part, mean over its cells."),
      parameter<&C::moved_part_occupied>("[0, 100]", "keyframes", "measured",
                                         "Most other keyframes of the window that occupied a moved "
                                         "part's voxels, mean over its cells."),
      parameter<&C::ground_log_odds>("[0, 10]", "", "measured",
                                     "Ground counts as seen through above this log-odds."),
      parameter<&C::ground_share>(
          "[0.001, 1]", "", "measured",
          "A patch of ground with at least this share of cells seen through is none."),
      parameter<&C::cell_size_m>("[0.05, 1]", "m", "as onboard",
                                 "Edge of the voxels of refinement: that of the robots' fine "
                                 "cells (voxel.fine_size_m). Another one is warned of."));
}

/// The unified map and what changed between sessions.
struct MapConfig {
  float voxel_size_m = kFineCellSizeM;
  float tree_voxel_size_m = 10.0F;
  float change_distance_m = 0.5F;
  float change_range_m = 30.0F;
  float free_margin_m = 0.6F;
  std::uint32_t min_observers = 2;
  std::uint32_t min_cluster = 20;
  float changed_share = 0.5F;
  float min_object_height_m = 0.4F;
  /// If more than this share of its own session's observations saw through an object, it
  /// moved or lets rays through.
  static constexpr float kObjectSeenThrough = 0.22F;
};

template <std::same_as<MapConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::voxel_size_m>("[0.05, 5]", "m", "choice", "Edge of a voxel of the map."),
      parameter<&C::tree_voxel_size_m>("[0.5, 50]", "m", "choice",
                                       "Edge of the voxels that have one kd-tree each."),
      parameter<&C::change_distance_m>(
          "[0.1, 2]", "m", "choice",
          "A changed point is this far from the nearest one of the other session."),
      parameter<&C::change_range_m>("[5, 200]", "m", "choice",
                                    "Range up to which a keyframe observes free space."),
      parameter<&C::free_margin_m>("[0.1, 5]", "m", "choice",
                                   "How far in front of a surface space is free."),
      parameter<&C::min_observers>("[1, 100]", "keyframes", "choice",
                                   "Keyframes that observed free space where a point changed."),
      parameter<&C::min_cluster>("[1, 1000]", "points", "choice",
                                 "Changed points that an object has at least."),
      parameter<&C::changed_share>(
          "[0, 1]", "", "choice",
          "Of a changed object's points about which the other session knows "
          "anything, this share has changed."),
      parameter<&C::min_object_height_m>("[0, 10]", "m", "choice",
                                         "Lower objects are none: kerbs, lines on the ground."));
}

/// Parameters of the merger.
struct MergeConfig {
  OdometryNoiseConfig odometry;     ///< drift of the odometry
  RegistrationConfig registration;  ///< registration clouds and G-ICP
  LoopConfig loops;                 ///< loop candidates and their verification
  AcceptanceConfig acceptance;      ///< sets of inter-session loops
  AliasingConfig aliasing;          ///< search for perceptual aliasing
  PositionConfig positions;         ///< known positions of keyframes
  GraphConfig graph;                ///< the pose graph
  RadiusConfig radius;              ///< radius search after alignment
  RefinementConfig refinement;      ///< refined labels
  MapConfig map;                    ///< the unified map and its changes
  std::uint32_t threads = 0;
  std::uint32_t memory_mb = 2000;

  /// What keyframes that are read on demand may take, and registration clouds as much.
  [[nodiscard]] constexpr std::uint64_t kept_bytes() const noexcept {
    return std::uint64_t{memory_mb} * 500'000;
  }
  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<MergeConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameters_in<&C::odometry>(), parameters_in<&C::registration>(), parameters_in<&C::loops>(),
      parameters_in<&C::acceptance>(), parameters_in<&C::aliasing>(),
      parameters_in<&C::positions>(), parameters_in<&C::graph>(), parameters_in<&C::radius>(),
      parameters_in<&C::refinement>(), parameters_in<&C::map>(),
      parameter<&C::threads>("[0, 256]", "threads", "choice",
                             "0: as many as the machine has; the result is the same."),
      parameter<&C::memory_mb>(
          "[1, 1000000]", "MB", "choice",
          "Keyframes that are read on demand and registration clouds take so much together; the "
          "result is the same."));
}

}  // namespace unimapper::merge
