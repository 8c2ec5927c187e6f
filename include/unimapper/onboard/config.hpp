// Parameters of the onboard pipeline: one struct per stage, a table of its members behind each.
//
// The tables state unit, accepted range, meaning and where the default comes from: "paper" is the
// Uni-Mapper paper, "STD" what it builds on, "measured" the comparison in docs/tuning.md, "sensor"
// the data sheet by way of the preset, "choice" our own. docs/parameters.md prints them.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

#include "unimapper/core/event_ring.hpp"
#include "unimapper/core/executor.hpp"
#include "unimapper/core/expected.hpp"
#include "unimapper/core/grid_size.hpp"
#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/parameter_table.hpp"
#include "unimapper/core/sensor.hpp"
#include "unimapper/free_space/evidence_weights.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper {

/// What the user's odometry promises.
struct OdometryConfig {
  float up_sigma_deg = 0.0F;

  /// `kOk`, or the first parameter out of its range.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<OdometryConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::up_sigma_deg>("0 or [0.01, 10]", "°", "choice",
                                  "How far the odometry's z axis may be from up, standard "
                                  "deviation: 0.1 to 1 where an IMU or GPS holds it. 0: nothing is "
                                  "promised, as where scans alone are matched and the sensor is "
                                  "mounted tilted; up then comes from walls, or is unknown."));
}

/// When a keyframe closes and which input is accepted (paper section IV-A).
struct KeyframeConfig {
  static constexpr std::uint32_t kMaxScans = 32;  ///< largest `scans`

  std::uint32_t scans = 10;
  float distance_m = 0.0F;
  float range_min_m = 0.5F;
  float range_max_m = 120.0F;
  float downsample_leaf_m = 0.0F;
  /// The pose may move this far from one scan to the next: farther is a jump of the odometry.
  float max_pose_step_m = 10.0F;
  /// After a gap between scans the pose may move this speed times the gap: no robot is faster.
  float max_speed_mps = 60.0F;
  std::uint32_t max_points_per_scan = 131072;

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<KeyframeConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::scans>("[1, 32]", "scans", "paper", "N_a: a keyframe closes after this many."),
      parameter<&C::distance_m>("[0, 1000]", "m", "paper: off",
                                "A keyframe also closes once the sensor is this far from where it "
                                "began; 0: never."),
      parameter<&C::range_min_m>("[0, 500]", "m", "sensor",
                                 "Nearer points are ignored and counted; below range_max_m."),
      parameter<&C::range_max_m>("[0, 500]", "m", "sensor",
                                 "Farther points are ignored and counted."),
      parameter<&C::downsample_leaf_m>("0 or [0.02, 2]", "m", "choice",
                                       "Of each scan only one point per cube of this size takes "
                                       "part in the mapping, the others get its label; 0: all do."),
      internal_parameter<&C::max_pose_step_m>("[0.001, 1000]", "m"),
      internal_parameter<&C::max_speed_mps>("[0, 1000]", "m/s"),
      parameter<&C::max_points_per_scan>("[16, 4194304]", "points", "sensor",
                                         "Capacity of a scan; what comes beyond is labelled static "
                                         "and counted."));
}

/// The two-level voxel grid and its planes (paper section IV-A).
struct VoxelConfig {
  float fine_size_m = kFineCellSizeM;
  float coarse_size_m = kCoarseVoxelSizeM;
  /// A coarse voxel is planar if its smallest eigenvalue is below this, square metres (STD).
  static constexpr float kPlaneMaxEigenvalueM2 = 0.01F;
  /// A coarse voxel with fewer points is not planar (STD).
  static constexpr std::uint32_t kPlaneMinPoints = 10;
  std::uint32_t max_cells = 1U << 18U;
  std::uint32_t max_window_blocks = 98304;
  std::uint32_t max_voxels = 1U << 15U;

  /// Capacity: blocks of 4 x 4 x 4 cells one keyframe occupies, 1.6 times as many as any scene
  /// measured needs: those of dense sensors hold six cells and more, those of others four.
  [[nodiscard]] std::uint32_t max_blocks() const noexcept {
    const std::uint32_t quarter = max_cells / 4;
    const std::uint32_t of_many = max_cells / 5 + 4096;
    return max_cells < 4 ? 1 : quarter < of_many ? quarter : of_many;
  }
  /// Fine cells along the edge of a coarse voxel.
  [[nodiscard]] std::int32_t cells_per_voxel() const noexcept;
  /// `kOk`, or the first thing that is wrong, in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<VoxelConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::fine_size_m>("[0.05, 1]", "m", "paper", "L_f: edge of a fine cell."),
      parameter<&C::coarse_size_m>("[0.5, 8]", "m", "paper",
                                   "L_c: edge of a coarse voxel, of removal, description and loop "
                                   "search alike; a whole multiple (2 to 64) of the fine size."),
      parameter<&C::max_cells>("[64, 8388608]", "cells", "sensor",
                               "Capacity: occupied fine cells of one keyframe."),
      parameter<&C::max_window_blocks>("[16, 4194304]", "blocks", "sensor",
                                       "Capacity: blocks of 4 x 4 x 4 cells that any keyframe of "
                                       "the window occupies, at least a quarter of max_cells, or "
                                       "a fifth and 4096; "
                                       "beyond it the oldest keyframes are evicted early."),
      parameter<&C::max_voxels>("[16, 1048576]", "voxels", "choice",
                                "Capacity: occupied coarse voxels of one keyframe."));
}

/// Ground and candidates (paper section IV-B).
struct GroundConfig {
  /// Ground normals lean at most this far from up, degrees (theta_A of the paper).
  static constexpr double kMaxTiltDeg = 30.0;
  float margin_m = 0.05F;
  /// A plane with points at most this far below it is a roof or a canopy, metres.
  static constexpr float kBelowDepthM = 12.0F;
  bool own_plane_first = true;
  std::uint32_t propagation_voxels = 1;
  float elevated_step_m = 0.2F;
  /// How far away ground is looked for that is lower than a ground voxel, metres.
  static constexpr float kElevatedReachM = 10.0F;
  float seen_through_share = EvidenceDefaults::kSeenThroughShare;
  float foot_height_m = EvidenceDefaults::kFootHeightM;
  float align_noise_deg = 0.15F;

  /// `kOk`, or the first thing that is wrong, in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<GroundConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::margin_m>("[-0.5, 1]", "m", "measured; paper: 0.1",
                              "m_th: points lower than this above the ground plane are ground."),
      parameter<&C::own_plane_first>("measured; paper: false",
                                     "Ground voxels are split by their own plane instead of the "
                                     "average with their neighbours', which would turn the "
                                     "pavement beside a kerb into an obstacle."),
      parameter<&C::propagation_voxels>("[1, 4]", "voxels", "measured; paper: 1",
                                        "How far from ground a voxel may take its ground plane "
                                        "from. 2, as preset for spinning sensors, finds the road "
                                        "below what drove past, where nothing is flat any more."),
      parameter<&C::elevated_step_m>("0 or [0.1, 2]", "m", "measured; paper: off",
                                     "Ground at least so much above ground within 10 m "
                                     "is none: what a moving vehicle leaves "
                                     "behind can be as flat as a road; 0: off."),
      parameter<&C::seen_through_share>("[0, 1]", "", "measured; paper: off",
                                        "Ground of which at least this share was seen through is "
                                        "none: where a sensor hardly sees the ground, the roof of "
                                        "a passing car is the lowest plane; 0: off."),
      parameter<&C::foot_height_m>("0 or [0.01, 0.5]", "m", "measured; paper: off",
                                   "Points of a ground cell below a dynamic one are dynamic from "
                                   "so high above the level of the ground around: feet; 0: off."),
      parameter<&C::align_noise_deg>("[0, 10]", "°", "measured",
                                     "From this attitude noise on, measured as the scatter of "
                                     "scans' tilt against the ground of the keyframe before, scans "
                                     "are aligned to that ground in roll, pitch and height before "
                                     "use; 0: never."));
}

/// What counts as evidence of free space (paper section IV-C).
struct FreeSpaceConfig {
  static constexpr std::uint32_t kMaxImages = 32;  ///< largest `images_per_keyframe`

  bool columns = false;
  bool visibility = true;
  std::uint32_t images_per_keyframe = 2;
  std::uint32_t earlier_image_stride = 1;
  float azimuth_resolution_deg = 0.4F;
  float elevation_resolution_deg = 0.5F;
  float horizontal_fov_deg = 360.0F;
  float elevation_min_deg = -45.0F;
  float elevation_max_deg = 45.0F;
  float range_margin_m = EvidenceDefaults::kRangeMarginM;
  float full_weight_range_m = 0.0F;
  /// Images of the keyframe itself are evidence too; not of a survey, whose points nothing moved.
  bool own_keyframe = true;
  float ray_spacing_deg = 0.0F;
  float ring_spacing_deg = 0.0F;
  std::uint32_t max_image_pixels = 0;

  /// Field of view and resolution of the free-space images.
  [[nodiscard]] RangeImageShape image_shape() const noexcept {
    return {horizontal_fov_deg, azimuth_resolution_deg, elevation_min_deg, elevation_max_deg,
            elevation_resolution_deg};
  }
  /// `kOk`, or the first thing that is wrong, in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<FreeSpaceConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::columns>("measured; paper: true",
                             "The paper's columns: cells between the ground and the lowest "
                             "obstacle above it are free. Asserts free space where no ray has "
                             "passed when rings are sparse."),
      parameter<&C::visibility>("measured; paper: false",
                                "Rays that passed through a cell: small range images, kept per "
                                "keyframe."),
      parameter<&C::images_per_keyframe>("[1, 32]", "images", "measured",
                                         "Range images per keyframe, from evenly spread scans, no "
                                         "more than keyframe.scans; 10 for patterns that do not "
                                         "repeat."),
      parameter<&C::earlier_image_stride>("[1, 32]", "images", "measured",
                                          "Of each earlier keyframe every so many-th image is "
                                          "evidence, its last one among them. More than 1 saves "
                                          "time and misses what few images saw through."),
      parameter<&C::azimuth_resolution_deg>("[0.1, 5]", "°", "measured; sensor",
                                            "Pixel width of a range image."),
      parameter<&C::elevation_resolution_deg>("[0.1, 5]", "°", "measured; sensor",
                                              "Pixel height of a range image."),
      parameter<&C::horizontal_fov_deg>("[1, 360]", "°", "sensor",
                                        "Width of the images' field of view about the sensor's x "
                                        "axis."),
      parameter<&C::elevation_min_deg>("[-90, 90]", "°", "sensor",
                                       "Lower edge of the field of view, below elevation_max_deg."),
      parameter<&C::elevation_max_deg>("[-90, 90]", "°", "sensor",
                                       "Upper edge of the field of view."),
      parameter<&C::range_margin_m>("[0.05, 5]", "m", "measured",
                                    "A cell is seen through if the image's range exceeds the "
                                    "cell's by this and 1 %."),
      parameter<&C::full_weight_range_m>("[0, 500]", "m", "measured; sensor",
                                         "Up to this range a cell that was seen through counts in "
                                         "full, beyond it in proportion: the farther out, the more "
                                         "room there is between two rays. Preset where "
                                         "neighbouring rays are two fine cells apart; 0: always in "
                                         "full."),
      no_parameter<&C::own_keyframe>(),
      parameter<&C::ray_spacing_deg>(
          "[0, 30]", "°", "sensor",
          "Between two rays of a ring, as pixels and full_weight_range_m "
          "assume; the scans are measured, and by a factor of 1.4 off they "
          "override both. 0: nothing is measured."),
      parameter<&C::ring_spacing_deg>("[0, 30]", "°", "sensor",
                                      "Between two neighbouring rings, as pixels and "
                                      "full_weight_range_m assume; 0 just if ray_spacing_deg is."),
      parameter<&C::max_image_pixels>("[0, 1048576]", "pixels", "choice",
                                      "Capacity: pixels of a range image that follows the scans; "
                                      "at least as many as the configured image takes."));
}

/// The binary Bayes filter and what follows it (paper section IV-D). The paper gives no log-odds.
struct RemovalConfig {
  static constexpr std::uint32_t kMaxWindow = 32;  ///< largest `window`

  std::uint32_t window = 10;
  bool candidates_next_to_ground = false;
  float log_odds_free = EvidenceDefaults::kLogOddsFree;
  float log_odds_occupied = EvidenceDefaults::kLogOddsOccupied;
  float log_odds_weakly_occupied = EvidenceDefaults::kLogOddsWeaklyOccupied;
  float log_odds_clamp = 6.0F;
  bool components = true;
  float connecting_height_m = EvidenceDefaults::kConnectingHeightM;
  float component_dynamic_share = 0.3F;
  float confirmed_static_log_odds = EvidenceDefaults::kConfirmedStaticLogOdds;
  bool confirmed_static_connects = false;
  /// Cells at or above this log-odds stay dynamic whatever their component is: a walker in
  /// front of what was never seen before does not belong to it.
  static constexpr float kConfirmedDynamicLogOdds = 2.0F;
  std::uint32_t cluster_cells = 12;
  /// Least height of a cluster of dynamic cells: false evidence on walls is scattered, metres.
  static constexpr float kClusterHeightM = 1.0F;
  /// Least log-odds of each cell of such a cluster.
  static constexpr float kClusterLogOdds = 0.3F;
  float pole_width_m = 0.06F;
  float persistence_share = 0.3F;
  bool final_labels = true;

  /// `kOk`, or the first thing that is wrong, in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<RemovalConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameter<&C::window>("[1, 32]", "keyframes", "paper",
                            "N: earlier keyframes whose evidence is used."),
      parameter<&C::candidates_next_to_ground>("measured; paper: true",
                                               "Only coarse voxels next to ground (and ground "
                                               "itself) can hold dynamic points; else every "
                                               "non-ground cell is a candidate."),
      parameter<&C::log_odds_free>("[0, 10]", "", "measured",
                                   "Log-odds of one observation of a cell as seen through, or in a "
                                   "free column. A cell is dynamic when the sum is positive, "
                                   "counted in thousandths."),
      parameter<&C::log_odds_occupied>(
          "[0, 10]", "", "measured",
          "Log-odds of one observation of a cell as occupied in an earlier keyframe."),
      parameter<&C::log_odds_weakly_occupied>(
          "[0, 10]", "", "measured", "Log-odds of one observation of a surface close to the cell."),
      parameter<&C::log_odds_clamp>("[0, 30]", "", "measured",
                                    "A cell that was a candidate in the keyframe before keeps its "
                                    "sum, clamped to this either way, and only newer evidence is "
                                    "added; 0: the whole window is weighed anew, which costs "
                                    "several times as much."),
      parameter<&C::components>("measured", "Decide about connected obstacles as a whole."),
      parameter<&C::connecting_height_m>("[0, 2]", "m", "measured",
                                         "Cells lower than this above the ground follow the "
                                         "component they touch, but do not connect components: "
                                         "kerbs and grass would tie every walker to the next "
                                         "wall."),
      parameter<&C::component_dynamic_share>("[0.1, 1]", "", "measured",
                                             "A component is dynamic if at least this share of the "
                                             "evidence for and against its cells says so, each "
                                             "cell's counted up to confirmed_static_log_odds. With "
                                             "less than 0.1 it is static; between the two each "
                                             "cell stands for itself."),
      parameter<&C::confirmed_static_log_odds>("[0.001, 1000]", "", "measured",
                                               "Cells at or below minus this log-odds stay static "
                                               "whatever their component is: a van that "
                                               "drives past does not take the parked car with it. "
                                               "Except low cells."),
      parameter<&C::confirmed_static_connects>(
          "measured",
          "Confirmed static cells connect components, as others do; else they follow "
          "one, unless they were proven dynamic in the keyframe before. Preset for "
          "patterns that do not repeat, whose static cells are seen through in "
          "patches."),
      parameter<&C::cluster_cells>("[0, 1000000]", "cells", "measured",
                                   "So many connected cells that are dynamic by their own "
                                   "evidence stay dynamic whatever their component is, with "
                                   "what touches them and has hardly any evidence against it; "
                                   "0: off."),
      parameter<&C::pole_width_m>("[0, 1]", "m", "measured",
                                  "What is no wider than two cells, or higher than a person and "
                                  "slender, may be a pole as thin as this. Where rays of a ring "
                                  "are farther apart (free_space.ray_spacing_deg, as measured), "
                                  "it does not count as seen through: it is static; 0: off."),
      parameter<&C::persistence_share>("[0, 1]", "", "measured",
                                       "A component stays dynamic if at least this share of its "
                                       "cells was dynamic in the keyframe before, and twice as "
                                       "many cells were dynamic as static there; 0: off."),
      parameter<&C::final_labels>("measured",
                                  "Relabel the undecided cells of a keyframe when it is evicted "
                                  "from the window."));
}

/// Everything the onboard pipeline can be told.
struct PipelineConfig {
  OdometryConfig odometry;       ///< what it promises
  KeyframeConfig keyframe;       ///< when a keyframe closes
  VoxelConfig voxel;             ///< grid and planes
  GroundConfig ground;           ///< ground and candidates
  FreeSpaceConfig free_space;    ///< evidence of free space
  RemovalConfig removal;         ///< labels
  DescriptorConfig descriptor;   ///< the place descriptor
  LoopSearchConfig loop_search;  ///< search among stored places
  /// The pipeline's own keyframes are stored as session 0; places of other runs inserted into
  /// `Pipeline::places()` take sessions from 1.
  SearchScope search_scope{SearchScope::Sessions::kAll, 50};
  bool deferred = false;
  bool intensity = false;
  std::uint32_t waiting_scans = 10;
  std::uint32_t budget_us = 0;
  /// Monotonic clock in nanoseconds for the stage times and the budget; null = no times are taken.
  std::int64_t (*clock_ns)() = nullptr;
  /// Where noteworthy events go (see `EventId`), or null. The pipeline is the ring's producer; the
  /// ring must outlive it.
  EventRing* events = nullptr;
  /// Who runs parts of what closes a keyframe at the same time; by default the calling thread does
  /// all. Every call returns when no part runs any more. The executor must outlive the pipeline.
  Executor executor;

  /// What describer and loop search have to be laid out for; follows from the other members.
  [[nodiscard]] DescriptorInput descriptor_input() const noexcept {
    return {voxel.coarse_size_m, voxel.max_cells, executor};
  }
  /// Capacities and voxel size by which a stored place is laid out.
  [[nodiscard]] PlaceShape place_shape() const noexcept {
    return {descriptor.max_keypoints, descriptor.max_planes, voxel.coarse_size_m};
  }
  /// `kOk`, or the first thing that is wrong, in words.
  [[nodiscard]] Error validate() const noexcept;
};

template <std::same_as<PipelineConfig> C>
consteval auto parameters_of(const C*) {
  return parameter_table(
      parameters_in<&C::odometry>(), parameters_in<&C::keyframe>(), parameters_in<&C::voxel>(),
      parameters_in<&C::ground>(), parameters_in<&C::free_space>(), parameters_in<&C::removal>(),
      parameters_in<&C::descriptor>(), parameters_in<&C::loop_search>(),
      parameters_in<&C::search_scope>(),
      parameter<&C::deferred>("choice",
                              "What closes a keyframe, and final labels, description and loop "
                              "search after that, are done in slices by the calls that follow, "
                              "about as much in each, with the same results. Takes room for the "
                              "cells of a second keyframe and for `waiting_scans`. false: "
                              "everything at once."),
      parameter<&C::intensity>("choice",
                               "Cells carry the mean intensity of their points, where scans come "
                               "with intensities: one byte for each static cell in messages. Takes "
                               "six bytes of memory for each of `voxel.max_cells`."),
      parameter<&C::waiting_scans>("[1, 100]", "", "choice",
                                   "With `deferred`: scans that can wait while a keyframe is being "
                                   "closed, 12 bytes for each of "
                                   "`keyframe.max_points_per_scan`. With fewer than half of "
                                   "`keyframe.scans` calls become uneven: one that leaves no room "
                                   "for another scan closes the keyframe at once."),
      parameter<&C::budget_us>("0 or [100, 10000000]", "µs", "choice",
                               "Longest that a call may take. With `deferred` what does not fit is "
                               "done later. A call that takes longer all the same is counted "
                               "(`deadline_missed`). Needs a clock; 0: no limit."),
      no_parameter<&C::clock_ns>(), no_parameter<&C::events>(), no_parameter<&C::executor>());
}

/// Recommended parameters for a sensor: capacities, range and field of view from its data
/// sheet, and one set of thresholds for spinning sensors, one for all others.
[[nodiscard]] PipelineConfig preset(SensorKind sensor) noexcept;

/// What the pipeline is to run on; decides capacities and range, never thresholds.
enum class Computer : std::uint8_t {
  kServer,        ///< x86-64, gigabytes to spare: what `preset(sensor)` assumes
  kJetson,        ///< Jetson-class ARM64: at most 192 MB
  kRaspberryPi,   ///< Raspberry-Pi-class ARMv8: at most 64 MB
  kArmv7With64Mb  ///< ARMv7 with NEON: at most 64 MB
};

/// The recommended parameters with the capacities a smaller computer has room for: fewer places
/// to recognise, a shorter range, fewer cells. docs/porting.md tells the bytes of each.
[[nodiscard]] PipelineConfig preset(SensorKind sensor, Computer computer) noexcept;

/// Recommended parameters for a spinning LiDAR in a mode of `columns` columns a turn. With 0
/// columns, or another pattern: as its data sheet says. A mode that is only found out while the
/// robot runs changes the images, but not the capacities.
[[nodiscard]] PipelineConfig preset(SensorKind sensor, Computer computer,
                                    std::uint32_t columns) noexcept;

/// Recommended parameters for a LiDAR that no preset knows, from its data sheet. `kInvalidConfig`
/// where a figure cannot be right (see `SensorModel`). For a known model it is what
/// `preset(model.kind)` gives.
[[nodiscard]] Expected<PipelineConfig> preset(const SensorModel& sensor,
                                              Computer computer = Computer::kServer) noexcept;

/// Whether a configuration has room for what a sensor may see. Cells that do not fit are those of
/// the last scans, near ones too: their points are labelled static without having been looked at
/// (`DropCause::kCellsFull`), so a shorter range is better than cells that are full.
struct SensorFit {
  std::uint32_t cells_needed = 0;  ///< fine cells that a keyframe may occupy in a dense street
  std::uint32_t cells = 0;         ///< fine cells that there is room for: `VoxelConfig::max_cells`
  float range_m = 0.0F;            ///< `KeyframeConfig::range_max_m` with which they fit, metres

  /// Whether there is room for all cells needed.
  [[nodiscard]] bool fits() const noexcept { return cells_needed <= cells; }
};

/// An estimate from the data sheet, before the first scan, for outdoors; how it compares with
/// recordings is in docs/porting.md. After it, `KeyframeStatistics::dropped_by` counts. O(1).
[[nodiscard]] SensorFit sensor_fit(const SensorModel& sensor,
                                   const PipelineConfig& config) noexcept;

/// Where the robot maps; decides how long keyframes are and how finely a place is described, never
/// a threshold of removal.
enum class Surroundings : std::uint8_t {
  kOutdoors,  ///< what every preset assumes
  kIndoors    ///< a room or hall: nearly all of what is seen is within 30 m
};

/// Adapts a configuration to surroundings, as `SurroundingsEstimator` tells them. Indoors columns
/// are finer, keypoints lie closer, and sides of triangles are shorter. Where scans come slowly,
/// `scan_interval_s` apart, keyframes have fewer of them: 2.5 s, at least five scans. At 10 Hz
/// keyframes stay as they are. No more memory.
[[nodiscard]] PipelineConfig adapt_to(Surroundings surroundings, PipelineConfig config,
                                      float scan_interval_s = 0.1F) noexcept;

/// The paper taken literally: free columns only, symmetric log-odds, candidates next to ground,
/// no components. For comparison.
[[nodiscard]] PipelineConfig paper_preset(SensorKind sensor) noexcept;

}  // namespace unimapper
