// Parameters of the onboard pipeline
//
// Every member states unit, accepted range and where its default comes from. "Paper" is the
// Uni-Mapper paper; "measured" means chosen by the comparison in docs/tuning.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "unimapper/core/event_ring.hpp"
#include "unimapper/core/expected.hpp"
#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/sensor.hpp"
#include "unimapper/free_space/evidence_weights.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper {

/// When a keyframe closes and which input is accepted (paper section IV-A).
struct KeyframeConfig {
  static constexpr std::uint32_t kMaxScans = 32;

  /// N_a: a keyframe closes after this many scans. [1, 32]; paper: 10.
  std::uint32_t scans = 10;
  /// A keyframe also closes once the sensor is this far from where it began, metres.
  /// 0 = never, else (0, 1000]; paper: off.
  float distance_m = 0.0F;
  /// Nearer and farther points are ignored and counted, metres. 0 <= min < max <= 500; sensor.
  float range_min_m = 0.5F;
  float range_max_m = 120.0F;
  /// Of each scan only one point per cube of this size takes part in the mapping; the others
  /// get its label. Metres; 0 = off, else [0.02, 2].
  float downsample_leaf_m = 0.0F;
  /// The pose may move this far from one scan to the next, metres. (0, 1000]; our choice.
  float max_pose_step_m = 10.0F;
  /// After a gap between scans the pose may move this speed times the gap, m/s. [0, 1000].
  float max_speed_mps = 60.0F;
  /// Capacity: points of one scan; what comes beyond is labelled static and counted.
  /// [1, 4194304]; sensor.
  std::uint32_t max_points_per_scan = 131072;

  /// `kOk`, or what is wrong in words.
  [[nodiscard]] Error validate() const noexcept;
};

/// The two-level voxel grid and its planes (paper section IV-A).
struct VoxelConfig {
  /// L_f: edge of a fine cell, metres. [0.05, 1]; paper: 0.2.
  float fine_size_m = 0.2F;
  /// L_c: edge of a coarse voxel, metres; a whole multiple (2 to 64) of the fine size;
  /// paper: 2.
  float coarse_size_m = 2.0F;
  /// A coarse voxel is planar if its smallest eigenvalue is below this, m^2. (0, 1];
  /// STD's value, which the paper builds on: 0.01.
  float plane_max_eigenvalue_m2 = 0.01F;
  /// and if it holds at least this many points. [3, 10000]; STD: 10.
  std::uint32_t plane_min_points = 10;
  /// Capacity: occupied fine cells of one keyframe. [1, 8388608]; our choice.
  std::uint32_t max_cells = 1U << 18U;
  /// Capacity: blocks of 4 x 4 x 4 cells that any keyframe of the window occupies; beyond it the
  /// oldest keyframes leave early. [1, 4194304]; our choice.
  std::uint32_t max_window_blocks = 98304;
  /// Capacity: occupied coarse voxels of one keyframe. [1, 1048576]; our choice.
  std::uint32_t max_voxels = 1U << 15U;

  /// Capacity: blocks of 4 x 4 x 4 cells one keyframe occupies. Blocks hold several cells each; a
  /// quarter is more than any scene measured needs.
  [[nodiscard]] std::uint32_t max_blocks() const noexcept {
    return max_cells < 4 ? 1 : max_cells / 4;
  }
  /// Fine cells along the edge of a coarse voxel.
  [[nodiscard]] std::int32_t cells_per_voxel() const noexcept;
  [[nodiscard]] Error validate() const noexcept;
};

/// Ground and candidates (paper section IV-B).
struct GroundConfig {
  /// theta_A: ground normals lean at most this far from up, degrees. (0, 80]; paper: 30.
  float max_tilt_deg = 30.0F;
  /// m_th: points lower than this above the ground plane are ground, metres. [-0.5, 1];
  /// paper: 0.1, measured: 0.05.
  float margin_m = 0.05F;
  /// A plane with points at most this far below it is a roof or a canopy, not ground, metres.
  /// [0, 100]; our choice (the paper says "points below").
  float below_depth_m = 12.0F;
  /// Ground voxels are split by their own plane instead of the average with their neighbours',
  /// which would turn the pavement beside a kerb into an obstacle; paper: false.
  bool own_plane_first = true;
  /// How many voxels away from G a voxel may take its ground from. More than 1 (paper) finds the
  /// road below what drove past, where nothing is flat any more; sensors that hardly see the ground
  /// have none to spare. [1, 4]; measured: 2 for spinning sensors, 1 for others.
  std::uint32_t propagation_voxels = 1;
  /// Ground that lies at least so much above ground within the reach is none: what a moving
  /// vehicle leaves behind can be as flat as a road. Metres; 0 = off (paper), else [0.1, 2], and
  /// [2, 50]; measured.
  float elevated_step_m = 0.2F;
  float elevated_reach_m = 10.0F;
  /// Ground of which at least this share was seen through is none: where a sensor hardly sees the
  /// ground, the roof of a passing car is the lowest plane. 0 = off (paper), else (0, 1]; measured.
  float seen_through_share = EvidenceDefaults::kSeenThroughShare;

  [[nodiscard]] Error validate() const noexcept;
};

/// What counts as evidence of free space (paper section IV-C).
struct FreeSpaceConfig {
  static constexpr std::uint32_t kMaxImages = 32;

  /// The paper's columns: cells between the ground and the lowest obstacle above it are free.
  /// Asserts free space where no ray has passed when rings are sparse; measured: off.
  bool columns = false;
  /// Rays that passed through a cell: small range images, kept per keyframe; measured: on.
  bool visibility = true;
  /// Range images per keyframe, from evenly spread scans. [1, 32]; measured: 2, and 10 for
  /// patterns that do not repeat.
  std::uint32_t images_per_keyframe = 2;
  /// Of each earlier keyframe every so many-th image is evidence, its last one among them. More
  /// than 1 saves time and misses what few images saw through. [1, 32]; measured: 1.
  std::uint32_t earlier_image_stride = 1;
  /// Pixel size of a range image, degrees. [0.1, 5]; measured: flat from 0.3 to 0.8.
  float azimuth_resolution_deg = 0.4F;
  float elevation_resolution_deg = 0.5F;
  /// The images' field of view about the sensor's x axis, degrees; sensor.
  float horizontal_fov_deg = 360.0F;
  float elevation_min_deg = -45.0F;
  float elevation_max_deg = 45.0F;
  /// A pixel holds the smallest range among itself and its eight neighbours, of which at
  /// least this many must have returned something. [1, 9]; measured: 3.
  std::uint32_t min_returns = 3;
  /// A cell is seen through if the range exceeds its own by more than this, metres plus a
  /// share of the range. [0.05, 5] and [0, 0.2]; measured: 0.3 and 0.01.
  float range_margin_m = EvidenceDefaults::kRangeMarginM;
  float range_margin_relative = EvidenceDefaults::kRangeMarginRelative;
  /// Up to this range a cell that was seen through counts in full, beyond it in proportion: the
  /// farther out, the more room there is between two rays, and the one that passed need not have
  /// passed through the cell. Metres; 0 = always in full, else (0, 500]; measured: where
  /// neighbouring rays are two fine cells apart.
  float full_weight_range_m = 0.0F;
  /// Images of the keyframe itself are evidence too; measured: on.
  bool own_keyframe = true;

  /// Field of view and resolution of the free-space images.
  [[nodiscard]] RangeImageShape image_shape() const noexcept {
    return {horizontal_fov_deg, azimuth_resolution_deg, elevation_min_deg, elevation_max_deg,
            elevation_resolution_deg};
  }
  [[nodiscard]] Error validate() const noexcept;
};

/// The binary Bayes filter and what follows it (paper section IV-D).
struct RemovalConfig {
  static constexpr std::uint32_t kMaxWindow = 32;

  /// N: earlier keyframes whose evidence is used. [1, 32]; paper: 10.
  std::uint32_t window = 10;
  /// Only coarse voxels next to ground (and ground itself) can hold dynamic points. Paper:
  /// true; measured: false, every non-ground cell is a candidate.
  bool candidates_next_to_ground = false;
  /// Log-odds per observation: seen through (or in a free column) / occupied in an earlier
  /// keyframe / a surface about there (half-way evidence). [0, 10]; a cell is dynamic when
  /// the sum is positive. Counted in thousandths. The paper gives no values; measured: see
  /// docs/tuning.md.
  float log_odds_free = EvidenceDefaults::kLogOddsFree;
  float log_odds_occupied = EvidenceDefaults::kLogOddsOccupied;
  float log_odds_weakly_occupied = EvidenceDefaults::kLogOddsWeaklyOccupied;
  /// A cell that was a candidate in the keyframe before keeps its sum, clamped to this either way,
  /// and only newer evidence is added; 0 = weigh the whole window anew in every keyframe, which
  /// costs several times as much. [0, 30]; measured.
  float log_odds_clamp = 6.0F;
  /// Decide about connected obstacles as a whole; measured: on.
  bool components = true;
  /// Cells lower than this above the ground follow the component they touch, but do not connect
  /// components: kerbs and grass would tie every walker to the next wall, metres. [0, 2]; measured.
  float connecting_height_m = EvidenceDefaults::kConnectingHeightM;
  /// A component is dynamic if at least this share of the evidence for and against its cells says
  /// so, each cell's counted up to `confirmed_static_log_odds`; with less than the second share it
  /// is static; between them each cell stands for itself. [0, 1]; measured.
  float component_dynamic_share = 0.3F;
  float component_static_share = EvidenceDefaults::kComponentStaticShare;
  /// Cells at or below minus this log-odds stay static whatever their component is:
  /// a van that drives past does not take the parked car with it. (0, 1000]; measured.
  float confirmed_static_log_odds = EvidenceDefaults::kConfirmedStaticLogOdds;
  /// A component stays dynamic if at least this share of its cells was dynamic in the keyframe
  /// before, and twice as many cells were dynamic as static there. [0, 1], 0 = off; measured.
  float persistence_share = 0.3F;
  /// Relabel the undecided cells of a keyframe when it is evicted from the window; measured: on.
  bool final_labels = true;

  [[nodiscard]] Error validate() const noexcept;
};

/// Everything the onboard pipeline can be told.
struct PipelineConfig {
  KeyframeConfig keyframe;
  VoxelConfig voxel;
  GroundConfig ground;
  FreeSpaceConfig free_space;
  RemovalConfig removal;
  DescriptorConfig descriptor;
  LoopSearchConfig loop_search;
  /// The pipeline's own keyframes are stored as session 0; places of other runs inserted into
  /// `Pipeline::places()` take sessions from 1.
  SearchScope search_scope{SearchScope::Sessions::kAll, 50};
  /// Longest that a call which closes a keyframe may take, microseconds. What does not fit is left
  /// out in the order of `Shed` and counted. 0 = never leave anything out, else [100, 10000000]
  /// and `clock_ns` must be set; our choice: off.
  std::uint32_t budget_us = 0;
  /// Monotonic clock in nanoseconds for the stage times and the budget; null = no times are taken.
  std::int64_t (*clock_ns)() = nullptr;
  /// Where noteworthy events go (see `EventId`), or null. The pipeline is the ring's producer; the
  /// ring must outlive it.
  EventRing* events = nullptr;

  /// `kOk`, or the first thing that is wrong, in words.
  [[nodiscard]] Error validate() const noexcept;
};

/// Recommended parameters for a sensor: capacities, range and field of view from its data
/// sheet, and one set of thresholds for spinning sensors, one for all others.
[[nodiscard]] PipelineConfig preset(SensorKind sensor) noexcept;

/// What the pipeline is to run on; decides capacities and range, never thresholds.
enum class Computer : std::uint8_t {
  kServer,        ///< x86-64, gigabytes to spare: what `preset(sensor)` assumes
  kJetson,        ///< Jetson-class ARM64: at most 192 MB
  kRaspberryPi,   ///< Raspberry-Pi-class ARMv8: at most 96 MB
  kArmv7With64Mb  ///< ARMv7 with NEON: at most 64 MB
};

/// The recommended parameters with the capacities a smaller computer has room for: fewer places
/// to recognise, a shorter range, fewer cells. docs/porting.md tells the bytes of each.
[[nodiscard]] PipelineConfig preset(SensorKind sensor, Computer computer) noexcept;

/// The same for a LiDAR that no preset knows, from its data sheet. `kInvalidConfig` where a figure
/// cannot be right (see `SensorModel`). For a known model it is what `preset(model.kind)` gives.
[[nodiscard]] Expected<PipelineConfig> preset(const SensorModel& sensor,
                                              Computer computer = Computer::kServer) noexcept;

/// The paper taken literally: free columns only, symmetric log-odds, candidates next to ground,
/// no components. For comparison.
[[nodiscard]] PipelineConfig paper_preset(SensorKind sensor) noexcept;

}  // namespace unimapper
