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

namespace unimapper::merge {

/// How odometry drifts: a random walk over the distance travelled. The defaults fit
/// LiDAR(-inertial) odometry of middling quality (5 cm and 0.1 degrees per 5 m); worse odometry
/// needs larger ones.
struct OdometryNoiseConfig {
  double translation_m_per_sqrt_m = 0.02;
  double rotation_rad_per_sqrt_m = 0.0008;
};

template <std::same_as<OdometryNoiseConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::translation_m_per_sqrt_m>(
          "[0.0001, 10]", "m/√m", "choice",
          "Growth of the translation's standard deviation with the square root of the path."),
      parameter<&C::rotation_rad_per_sqrt_m>(
          "[0.000001, 1]", "rad/√m", "choice",
          "Growth of the rotation's standard deviation with the square root of the path."));
}

/// Registration clouds and G-ICP (paper section VI, refined registration).
struct RegistrationConfig {
  float leaf_m = 0.4F;
  std::uint32_t max_points = 12000;        ///< the leaf grows until a cloud is smaller
  std::uint32_t max_source_points = 4000;  ///< points of a source that are aligned
  std::uint32_t max_iterations = 24;       ///< of both stages together
  /// So far along its weakest axis the registration of a loop is started again, either way, metres.
  static constexpr double kProbeM = 1.5;
  /// A loop says nothing along its weakest axis if a restart that fits ends farther off, metres.
  static constexpr double kProbeSlipM = 0.5;
};

template <std::same_as<RegistrationConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::leaf_m>("[0.05, 5]", "m", "choice", "Spacing of registration points."),
      internal_parameter<&C::max_points>("[100, 1000000]", "points"),
      internal_parameter<&C::max_source_points>("[100, 1000000]", "points"),
      internal_parameter<&C::max_iterations>("[1, 200]"));
}

/// Where loop candidates come from and when their geometry is verified.
struct LoopConfig {
  std::uint32_t min_keyframe_gap = 15;
  double min_path_gap_m = 20.0;
  /// Candidates verified per pair of sessions, spread over places.
  std::uint32_t max_candidates_per_pair = 200;
  double min_overlap = 0.45;
  double max_contradiction = 0.5;  ///< share of the points that lie inside the other's free space
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
      internal_parameter<&C::max_candidates_per_pair>("[1, 5000]"),
      parameter<&C::min_overlap>("[0, 1]", "", "choice",
                                 "Overlap of structure (no ground) after G-ICP; two thirds of it "
                                 "where the common view agrees."),
      internal_parameter<&C::max_contradiction>("[0, 1]"));
}

/// When inter-session loops are accepted (docs/design/loop-acceptance.md).
struct AcceptanceConfig {
  /// Two loops are consistent up to this chi square: 99 % with 6 degrees of freedom.
  double consistency_chi2 = 16.81;
  std::uint32_t min_loops = 3;
  double min_span_m = 20.0;
  std::uint32_t min_strong_loops = 2;
  /// Overlap of a loop, 0 to 1, from which on it is a strong one.
  static constexpr double kStrongOverlap = 0.7;
  double margin = 2.0;
  /// Consistency set over a competing set that alone would connect the maps; below it the pair is
  /// provisional.
  double sufficient_margin = 4.0;
  double distinct_m = 2.0;
  /// Loops within so short a path lie in one place, and one place may look like another: sensor
  /// data elsewhere must confirm them.
  double place_span_m = 100.0;
  /// A loop knows the position along a direction if its standard deviation is smaller.
  double vote_sigma_m = 1.0;
  /// Two loops within a session confirm each other if odometry between them is as sure (standard
  /// deviation, metres). Keyframes of two sessions are compared as far from a loop.
  static constexpr double kConfirmingSigmaM = 1.0;
  /// Where keyframes of both maps see less far (radius within which 95 % of their static cells
  /// lie), `min_span_m`, `distinct_m` and `place_span_m` are shorter in proportion; measured,
  /// metres.
  static constexpr double kFullExtentM = 40.0;
  /// Spans and distances of small maps shrink to no less than this share.
  static constexpr double kSmallestScale = 0.4;
  double loop_chi2 = 22.5;
};

template <std::same_as<AcceptanceConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      internal_parameter<&C::consistency_chi2>("[1, 200]"),
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
      internal_parameter<&C::sufficient_margin>("[1, 100]"),
      parameter<&C::distinct_m>("[0, 100]", "m", "choice",
                                "Loops closer than this along either path count once."),
      internal_parameter<&C::place_span_m>("[0, 1000]", "m"),
      internal_parameter<&C::vote_sigma_m>("[0.01, 100]", "m"),
      parameter<&C::loop_chi2>("[1, 1000]", "", "choice",
                               "A loop beyond this after optimisation is rejected."));
}

/// Search for perceptual aliasing before two maps are merged.
struct AliasingConfig {
  /// To see whether a place repeats, loops are moved to keyframes of the same map at least so far
  /// away, metres.
  static constexpr double kMinShiftM = 4.0;
  /// They fit there as well if of the structure facing the shift this share coincides, of what
  /// coincides here; measured.
  double alike_share = 0.8;
  /// A place is below a ceiling if this share of its ground has structure above it.
  static constexpr double kRoofedShare = 0.5;
  /// A place below a ceiling may be another storey if this share of the structure lies in the
  /// other's free space, and the geometric mean of that and of what stands in one session alone is
  /// as large; measured.
  double changed_share = 0.08;
};

template <std::same_as<AliasingConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(internal_parameter<&C::alike_share>("[0.1, 2]"),
                         internal_parameter<&C::changed_share>("[0, 1]"));
}

/// Pose graph optimisation.
struct GraphConfig {
  double cauchy_scale = 3.5;
  std::uint32_t max_iterations = 60;  ///< of one solve
  double deformation_floor_m = 1.0;   ///< deformation of a session that is always plausible
};

template <std::same_as<GraphConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::cauchy_scale>("[0.1, 1000]", "", "paper",
                                  "xi of the paper's kernel, on whitened residuals."),
      internal_parameter<&C::max_iterations>("[1, 1000]"),
      internal_parameter<&C::deformation_floor_m>("[0, 100]", "m"));
}

/// Radius search between aligned maps (paper section VI, equation for R).
struct RadiusConfig {
  double radius_m = 10.0;
};

template <std::same_as<RadiusConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(parameter<&C::radius_m>(
      "[0.5, 100]", "m", "paper", "r_th: radius within which keyframes are searched for."));
}

/// What is static, decided again with later evidence (paper section IV-D), which weighs as
/// `EvidenceDefaults` says.
struct RefinementConfig {
  std::uint32_t window = 10;
  /// Most keyframes of any session, outside the window, whose evidence is used: the nearest;
  /// measured.
  std::uint32_t revisits = 10;
  float reach_m = 30.0F;  ///< keyframes outside the window are used within this distance; measured
  float cell_size_m = kFineCellSizeM;
};

template <std::same_as<RefinementConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::window>(
          "[0, 100]", "keyframes", "measured",
          "Keyframes before and after one whose evidence is used; 0: no refinement."),
      internal_parameter<&C::revisits>("[0, 1000]", "keyframes"),
      internal_parameter<&C::reach_m>("[1, 500]", "m"),
      parameter<&C::cell_size_m>("[0.05, 1]", "m", "as onboard",
                                 "Edge of the voxels of refinement: that of the robots' fine "
                                 "cells (voxel.fine_size_m). Another one is warned of."));
}

/// The unified map and what changed between sessions.
struct MapConfig {
  float voxel_size_m = kFineCellSizeM;
  float change_distance_m = 0.5F;
  float change_range_m = 30.0F;
  std::uint32_t min_cluster = 20;
  float min_object_height_m = 0.4F;
  /// If more than this share of its own session's observations saw through an object, it
  /// moved or lets rays through.
  static constexpr float kObjectSeenThrough = 0.22F;
};

template <std::same_as<MapConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::voxel_size_m>("[0.05, 5]", "m", "choice", "Edge of a voxel of the map."),
      parameter<&C::change_distance_m>(
          "[0.1, 2]", "m", "choice",
          "A changed point is this far from the nearest one of the other session."),
      parameter<&C::change_range_m>("[5, 200]", "m", "choice",
                                    "Range up to which a keyframe observes free space."),
      parameter<&C::min_cluster>("[1, 1000]", "points", "choice",
                                 "Changed points that an object has at least."),
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
      parameters_in<&C::acceptance>(), parameters_in<&C::aliasing>(), parameters_in<&C::graph>(),
      parameters_in<&C::radius>(), parameters_in<&C::refinement>(), parameters_in<&C::map>(),
      parameter<&C::threads>("[0, 256]", "threads", "choice",
                             "0: as many as the machine has; the result is the same."),
      parameter<&C::memory_mb>(
          "[1, 1000000]", "MB", "choice",
          "Keyframes that are read on demand and registration clouds take so much together; the "
          "result is the same."));
}

}  // namespace unimapper::merge
