// The LiDARs the presets know.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

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

/// Data-sheet figures of one LiDAR.
struct SensorModel {
  SensorKind kind;
  std::string_view name;  ///< canonical spelling, e.g. "os2-128"
  ScanPattern pattern;
  float horizontal_fov_deg;  ///< full width
  float elevation_min_deg;
  float elevation_max_deg;
  float range_min_m;
  float range_max_m;
  std::uint32_t rings;            ///< scan lines; 0 if the pattern does not repeat
  std::uint32_t points_per_scan;  ///< rays per scan at `scan_rate_hz`
  float scan_rate_hz;
};

/// All models, the generic one first.
[[nodiscard]] std::span<const SensorModel> sensor_models() noexcept;

/// The model of `kind`.
[[nodiscard]] const SensorModel& sensor_model(SensorKind kind) noexcept;

/// Finds a model by name. Letter case, spaces, dashes and the maker's name do not matter:
/// "OS2-128", "os2_128" and "ouster os2 128" are the same. Null if unknown.
[[nodiscard]] const SensorModel* find_sensor(std::string_view name) noexcept;

}  // namespace unimapper
