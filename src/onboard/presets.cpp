// Presets: parameters from a sensor's data sheet and a computer's memory.
#include <algorithm>
#include <cmath>

#include "src/onboard/sampling/sampling.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper {
namespace {

/// Fine cells of a keyframe, for sensors of any range. A dense long-range sensor fills 350 000
/// cells in a wide street, with twice the rays nearly twice as many.
std::uint32_t most_cells(const SensorModel& sensor) noexcept {
  return sensor.points_per_scan > 200000U   ? 3U << 18U
         : sensor.points_per_scan > 100000U ? 3U << 17U
         : sensor.points_per_scan > 50000U  ? 1U << 18U
                                            : 1U << 17U;
}

/// What follows from the data sheet alone.
void apply_data_sheet(const SensorModel& sensor, PipelineConfig& config) noexcept {
  config.keyframe.range_min_m = sensor.range_min_m;
  config.keyframe.range_max_m = sensor.range_max_m;
  // A quarter more than the nominal rate, for second returns and odd sweeps; whole pages.
  const std::uint32_t points = sensor.points_per_scan + sensor.points_per_scan / 4;
  config.keyframe.max_points_per_scan = (points + 4095U) / 4096U * 4096U;
  config.voxel.max_cells = most_cells(sensor);

  // The cells of sparse sensors lie farther apart: fewer of them share a block.
  const bool sparse = sensor.points_per_scan <= 50000U;
  config.voxel.max_window_blocks =
      sparse ? config.voxel.max_cells / 2 : config.voxel.max_cells / 8 * 3;

  config.free_space.horizontal_fov_deg =
      std::min(sensor.horizontal_fov_deg + 2.0F * kImageSlackDeg, 360.0F);
  config.free_space.elevation_min_deg = std::max(sensor.elevation_min_deg - kImageSlackDeg, -90.0F);
  config.free_space.elevation_max_deg = std::min(sensor.elevation_max_deg + kImageSlackDeg, 90.0F);
}

/// Degrees between neighbouring rays on average, where there are no rings.
float mean_spacing_deg(const SensorModel& sensor) noexcept {
  const float height_deg = sensor.elevation_max_deg - sensor.elevation_min_deg;
  const float width_deg = std::min(sensor.horizontal_fov_deg, 360.0F);
  return std::sqrt(width_deg * height_deg / static_cast<float>(sensor.points_per_scan));
}

/// Pixels follow the rays. Patterns that do not repeat need an image per scan, with pixels as large
/// as the gaps.
void apply_pattern(const SensorModel& sensor, PipelineConfig& config) noexcept {
  FreeSpaceConfig& free_space = config.free_space;
  if (sensor.pattern == ScanPattern::kSpinning) {
    config.ground.propagation_voxels = 2;
    onboard::apply_sampling(onboard::sampling_of(sensor), config.voxel.fine_size_m, free_space);
    // Twice the pixels: a sensor mounted at an angle sees as wide a band, tilted.
    free_space.max_image_pixels =
        2 * static_cast<std::uint32_t>(ImageProjection(free_space.image_shape()).pixels());
    return;
  }
  const float spacing_deg = mean_spacing_deg(sensor);
  constexpr float kFinestDeg = 0.3F;
  free_space.full_weight_range_m = std::min(
      2.0F * config.voxel.fine_size_m * static_cast<float>(kDegreesPerRadian) / spacing_deg,
      500.0F);
  free_space.images_per_keyframe = 10;
  config.removal.confirmed_static_connects = true;
  config.removal.cluster_cells = 0;
  free_space.azimuth_resolution_deg =
      std::clamp(spacing_deg, kFinestDeg, onboard::kCoarsestPixelDeg);
  free_space.elevation_resolution_deg = free_space.azimuth_resolution_deg;
}

/// Leaves only the capacities a computer has room for.
void apply_computer(Computer computer, PipelineConfig& config) noexcept {
  struct Room {
    std::uint32_t cells;
    std::uint32_t window_blocks;
    std::uint32_t voxels;
    std::uint32_t places;
    std::uint32_t window;   ///< keyframes
    std::uint32_t matches;  ///< matched triangles of a search
    float range_m;
  };
  constexpr Room kJetson{393216, 147456, 32768, 1000, 10, 65536, 120.0F};
  constexpr Room kRaspberryPi{256000, 64000, 16384, 200, 8, 16384, 64.0F};
  constexpr Room kArmv7With64Mb{131072, 36864, 8192, 220, 10, 65536, 40.0F};
  if (computer == Computer::kServer) return;
  const Room& room = computer == Computer::kJetson        ? kJetson
                     : computer == Computer::kRaspberryPi ? kRaspberryPi
                                                          : kArmv7With64Mb;
  VoxelConfig& voxel = config.voxel;
  voxel.max_cells = std::min(voxel.max_cells, room.cells);
  voxel.max_window_blocks = std::min(voxel.max_window_blocks, room.window_blocks);
  voxel.max_voxels = std::min(voxel.max_voxels, room.voxels);
  config.removal.window = std::min(config.removal.window, room.window);
  config.loop_search.max_places = std::min(config.loop_search.max_places, room.places);
  config.loop_search.max_matches = std::min(config.loop_search.max_matches, room.matches);
  config.keyframe.range_max_m = std::min(config.keyframe.range_max_m, room.range_m);
  // So wide a band, which is also imaged where nobody knows the LiDAR, gets no room for a tilt.
  constexpr float kWideBandDeg = 90.0F;
  const float band_deg = config.free_space.elevation_max_deg - config.free_space.elevation_min_deg;
  const bool is_small = computer != Computer::kJetson;
  if (is_small && band_deg >= kWideBandDeg) config.free_space.max_image_pixels /= 2;
}

/// Fine cells that a keyframe occupies in a dense street, by the range.
struct CellDemand {
  float per_metre;      ///< most, where rays lie closer than cells
  float most;           ///< of any range
  float half_within_m;  ///< range within which half of these lie

  [[nodiscard]] float cells_within(float range_m) const noexcept {
    return std::min(per_metre * range_m, most * range_m / (range_m + half_within_m));
  }
  /// The inverse, for fewer cells than `most`.
  [[nodiscard]] float range_of(float cells) const noexcept {
    return std::max(cells / per_metre, half_within_m * cells / (most - cells));
  }
};

/// Measured with all seven sensors in the simulated towns with seeds 3 and 11, within 40 m, 60 m
/// and their range; what comes of it is 1 % below to 31 % above the denser one. The denser the
/// rays, the farther away they still add cells. How many a ray adds in ten scans depends on its
/// elevation: those that rise to 15 degrees end at facades, those that sink as far on the ground
/// near by, steeper ones in cells that others occupy too, unless the pattern never repeats.
CellDemand cell_demand(const SensorModel& sensor, float cell_size_m) noexcept {
  constexpr float kBandDeg = 15.0F;
  constexpr float kRisingCells = 4.9F;
  constexpr float kSinkingCells = 2.9F;
  const float steep_cells = sensor.pattern == ScanPattern::kNonRepetitive ? 2.95F : 1.2F;
  const auto within = [&sensor](float low_deg, float high_deg) noexcept {
    return std::max(
        std::min(sensor.elevation_max_deg, high_deg) - std::max(sensor.elevation_min_deg, low_deg),
        0.0F);
  };
  const float height_deg = sensor.elevation_max_deg - sensor.elevation_min_deg;
  const float rising_deg = within(0.0F, kBandDeg);
  const float sinking_deg = within(-kBandDeg, 0.0F);
  const float cells_per_ray = (kRisingCells * rising_deg + kSinkingCells * sinking_deg +
                               steep_cells * (height_deg - rising_deg - sinking_deg)) /
                              height_deg;
  // Cells grow with the power -1.5 of their size (0.25 m: 0.71 of those of 0.2 m).
  const float finer = VoxelConfig{}.fine_size_m / cell_size_m;
  const float factor = finer * std::sqrt(finer);
  return {4000.0F * factor, cells_per_ray * static_cast<float>(sensor.points_per_scan) * factor,
          18.0F / mean_spacing_deg(sensor)};
}

PipelineConfig from_model(const SensorModel& sensor, Computer computer) noexcept {
  PipelineConfig config;
  apply_data_sheet(sensor, config);
  apply_pattern(sensor, config);
  apply_computer(computer, config);
  return config;
}

}  // namespace

PipelineConfig preset(SensorKind sensor) noexcept { return preset(sensor, Computer::kServer); }

PipelineConfig preset(SensorKind sensor, Computer computer) noexcept {
  return from_model(sensor_model(sensor), computer);
}

PipelineConfig preset(SensorKind sensor, Computer computer, std::uint32_t columns) noexcept {
  SensorModel model = sensor_model(sensor);
  constexpr std::uint32_t kMostColumns = 16384;
  if (columns > 0 && model.pattern == ScanPattern::kSpinning) {
    model.points_per_scan = std::min(columns, kMostColumns) * model.rings;
  }
  return from_model(model, computer);
}

Expected<PipelineConfig> preset(const SensorModel& sensor, Computer computer) noexcept {
  const Error invalid = sensor.validate();
  if (!invalid.ok()) return invalid;
  const PipelineConfig config = from_model(sensor, computer);
  const Error unusable = config.validate();
  if (!unusable.ok()) return unusable;
  return config;
}

SensorFit sensor_fit(const SensorModel& sensor, const PipelineConfig& config) noexcept {
  const CellDemand demand = cell_demand(sensor, config.voxel.fine_size_m);
  const float range_m = std::min(config.keyframe.range_max_m, sensor.range_max_m);
  SensorFit fit;
  fit.cells = config.voxel.max_cells;
  fit.cells_needed = static_cast<std::uint32_t>(std::min(demand.cells_within(range_m), 4e9F));
  fit.range_m = fit.fits() ? range_m : demand.range_of(static_cast<float>(fit.cells));
  return fit;
}

PipelineConfig adapt_to(Surroundings surroundings, PipelineConfig config,
                        float scan_interval_s) noexcept {
  constexpr float kLongestKeyframe_s = 2.5F;
  constexpr std::uint32_t kShortestKeyframe_scans = 5;
  if (surroundings == Surroundings::kOutdoors) return config;
  // Fewer scans, less evidence: only where ten of them last too long.
  while (config.keyframe.scans > kShortestKeyframe_scans &&
         static_cast<float>(config.keyframe.scans) * scan_interval_s > kLongestKeyframe_s) {
    --config.keyframe.scans;
  }
  // Range and column size together determine the memory of the map of vertical structure.
  config.descriptor.range_m = 30.0F;
  config.descriptor.column_size_m = 0.2F;
  config.descriptor.window_m = 0.5F;
  config.descriptor.suppression_radius_m = 1.0F;
  config.loop_search.triangles.min_side_m = 2.0F;
  config.loop_search.triangles.max_side_m = 20.0F;
  // What is evaluated per keyframe is no more than its scans.
  config.free_space.images_per_keyframe =
      std::min(config.free_space.images_per_keyframe, config.keyframe.scans);
  return config;
}

PipelineConfig paper_preset(SensorKind sensor) noexcept {
  PipelineConfig config;
  apply_data_sheet(sensor_model(sensor), config);
  config.ground.margin_m = 0.1F;
  config.ground.own_plane_first = false;
  config.ground.elevated_step_m = 0.0F;
  config.ground.seen_through_share = 0.0F;
  config.ground.foot_height_m = 0.0F;
  config.free_space.columns = true;
  config.free_space.visibility = false;
  config.removal.candidates_next_to_ground = true;
  config.removal.log_odds_occupied = config.removal.log_odds_free;
  config.removal.log_odds_weakly_occupied = 0.0F;
  config.removal.log_odds_clamp = 0.0F;
  config.removal.components = false;
  config.removal.persistence_share = 0.0F;
  config.removal.final_labels = false;
  return config;
}

}  // namespace unimapper
