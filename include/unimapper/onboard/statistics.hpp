// Statistics of each keyframe
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace unimapper {

/// Why something was left out.
enum class DropCause : std::uint8_t {
  kNotFinite,         ///< points with NaN or infinite coordinates
  kOutOfRange,        ///< points nearer or farther than the configured range
  kScanTooLarge,      ///< points beyond `KeyframeConfig::max_points_per_scan`
  kCellsFull,         ///< points that found no room among the fine cells or their blocks
  kVoxelsFull,        ///< fine cells that found no room among the coarse voxels
  kEvidenceFull,      ///< columns, and blocks with parts or to be relabelled, without room
  kDescriptionFull,   ///< cells, voxels or keypoints the place describer refused
  kTriangleTableFull  ///< triangles the place database refused
};
inline constexpr std::size_t kDropCauses = 8;

/// A name for log files, e.g. "out_of_range".
[[nodiscard]] std::string_view drop_cause_name(DropCause cause) noexcept;

/// The parts of a keyframe's processing that are timed.
enum class Stage : std::uint8_t {
  kIngest,       ///< all its scans into fine cells and range images
  kRemoval,      ///< voxels, ground, free space, static / dynamic, final labels
  kDescription,  ///< keypoints and planes
  kSearch,       ///< loop search and insertion
  kTotal         ///< everything spent on it inside `add_scan`, `flush` and `work`
};
inline constexpr std::size_t kStages = 5;

/// "ingest", "removal", "description", "search" or "total".
[[nodiscard]] std::string_view stage_name(Stage stage) noexcept;

/// A fixed-capacity container's fill when the keyframe closed.
struct CapacityUse {
  std::uint64_t used = 0;      ///< elements in use
  std::uint64_t capacity = 0;  ///< elements there is room for
};

/// The containers whose fill is reported.
enum class Capacity : std::uint8_t { kPointsPerScan, kCells, kVoxels, kBlocks, kPlaces };
inline constexpr std::size_t kCapacities = 5;

/// A name for log files, e.g. "cells".
[[nodiscard]] std::string_view capacity_name(Capacity capacity) noexcept;

/// What the scans say of their sensor, measured at the start and every few keyframes; spinning
/// sensors only (`FreeSpaceConfig::ray_spacing_deg`).
struct SamplingStatistics {
  float ray_spacing_deg = 0.0F;   ///< between two rays of a ring; 0 = not known
  float ring_spacing_deg = 0.0F;  ///< from ring to ring; 0 = not known
  bool rays_differ = false;       ///< from what the configuration assumed, which was overridden
  /// Rays left the configured field of view, by more than the sensor turned in a sweep.
  bool elevations_differ = false;
  float image_elevation_min_deg = 0.0F;  ///< field of view of the range images
  float image_elevation_max_deg = 0.0F;  ///< field of view of the range images
  std::uint32_t changes = 0;  ///< how often the sensor has changed its mode since the start
};

/// Counts and times of one keyframe.
struct KeyframeStatistics {
  std::uint64_t points_in = 0;                       ///< points handed over in its scans
  std::uint64_t points_valid = 0;                    ///< finite and within range
  std::uint64_t points_static = 0;                   ///< labelled static
  std::uint64_t points_dynamic = 0;                  ///< labelled dynamic
  std::uint32_t cells = 0;                           ///< occupied fine cells
  std::uint32_t dynamic_cells = 0;                   ///< occupied fine cells labelled dynamic
  std::uint32_t voxels = 0;                          ///< occupied coarse voxels
  std::uint32_t ground_voxels = 0;                   ///< occupied coarse voxels with a ground plane
  std::uint32_t components = 0;                      ///< connected obstacles that may have moved
  std::uint32_t walls = 0;                           ///< upright planes that up was looked for in
  std::array<std::uint64_t, kDropCauses> dropped{};  ///< by `DropCause`
  std::array<CapacityUse, kCapacities> capacity{};   ///< by `Capacity`
  /// Microseconds; zero without a clock.
  std::array<float, kStages> stage_us{};
  /// Angle between up and the odometry's z axis, degrees; 0 where up is unknown.
  float odometry_tilt_deg = 0.0F;
  bool up_known = false;         ///< as in `KeyframeUp`
  bool up_contradicted = false;  ///< up is not where `odometry.up_sigma_deg` says, by three sigma
  SamplingStatistics sampling;   ///< of the sensor
  /// Root mean square of the scans' roll and pitch against the ground of the scans before, degrees,
  /// over the last few keyframes, less the error of that measurement; 0 where it is not clearly
  /// more than its error, where too little ground is seen, or where `sweep_tilt_deg` is what it is.
  float attitude_noise_deg = 0.0F;
  /// Root mean square of roll and pitch where they follow the sensor's own rotation: the sweeps
  /// look as if they were not motion-compensated; else 0.
  float sweep_tilt_deg = 0.0F;
  std::uint32_t aligned_scans = 0;  ///< scans that were aligned to that ground before use
  /// The call that closed it took longer than the budget; with `PipelineConfig::deferred`, some
  /// call since the keyframe before was ready did.
  bool deadline_missed = false;
  /// With `PipelineConfig::deferred`: slices of closing it that lengthened a call, because no other
  /// scan could wait.
  std::uint32_t late_slices = 0;

  /// What was dropped for this cause.
  [[nodiscard]] std::uint64_t dropped_by(DropCause cause) const noexcept {
    return dropped[static_cast<std::size_t>(cause)];
  }
  /// Time of a stage, microseconds; 0 without a clock.
  [[nodiscard]] float microseconds(Stage stage) const noexcept {
    return stage_us[static_cast<std::size_t>(stage)];
  }
};

}  // namespace unimapper
