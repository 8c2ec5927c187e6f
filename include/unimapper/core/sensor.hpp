// LiDAR models: data-sheet figures of known sensors, and of any other.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "unimapper/core/expected.hpp"

namespace unimapper {

/// The LiDARs of the paper, KITTI's HDL-64E, and a generic fallback.
enum class SensorKind : std::uint8_t {
  kGeneric,
  kHdl64e,
  kVlp16,
  kOs1_64,
  kOs2_128,
  kAevaAeries2,
  kLivoxAvia,
  kLivoxMid360,
};

/// How a sensor scans; decides how range evidence is rasterised.
enum class ScanPattern : std::uint8_t { kSpinning, kRaster, kNonRepetitive };

/// Data-sheet figures of one LiDAR. For one that no preset knows, fill in every figure and hand the
/// model to `preset(model)`: what is left out is refused.
struct SensorModel {
  SensorKind kind = SensorKind::kGeneric;        ///< `kGeneric` for a LiDAR that no preset knows
  std::string_view name;                         ///< canonical spelling, e.g. "os2-128"
  ScanPattern pattern = ScanPattern::kSpinning;  ///< how it scans
  float horizontal_fov_deg = 0.0F;  ///< full width about the x axis, degrees. [10, 360]
  float elevation_min_deg = 0.0F;   ///< lowest ray, degrees. [-90, elevation_max_deg - 1]
  float elevation_max_deg = 0.0F;   ///< highest ray, degrees. [elevation_min_deg + 1, 90]
  float range_min_m = 0.0F;         ///< smallest range, metres. [0, range_max_m)
  float range_max_m = 0.0F;         ///< largest range, metres. (range_min_m, 500]
  /// Scan lines. [2, 1024] where they repeat, which range images of spinning sensors follow; 0 if
  /// the pattern does not repeat.
  std::uint32_t rings = 0;
  std::uint32_t points_per_scan = 0;  ///< rays per scan at `scan_rate_hz`. [100, 3300000]
  float scan_rate_hz = 0.0F;          ///< (0, 200]

  /// `kOk`, or the first figure that no LiDAR can have, in words.
  [[nodiscard]] Error validate() const noexcept;
};

/// All models, the generic one first.
[[nodiscard]] std::span<const SensorModel> sensor_models() noexcept;

/// The model of `kind`.
[[nodiscard]] const SensorModel& sensor_model(SensorKind kind) noexcept;

/// Finds a model by name. Letter case, spaces, dashes and the maker's name do not matter:
/// "OS2-128", "os2_128" and "ouster os2 128" are the same. Null if unknown.
[[nodiscard]] const SensorModel* find_sensor(std::string_view name) noexcept;

}  // namespace unimapper
