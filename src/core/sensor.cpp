#include "unimapper/core/sensor.hpp"

#include <array>

namespace unimapper {
namespace {

constexpr std::array<SensorModel, 8> kModels{{
    {SensorKind::kGeneric, "generic", ScanPattern::kSpinning, 360.0F, -45.0F, 45.0F, 0.5F, 120.0F,
     64, 131072, 10.0F},
    {SensorKind::kHdl64e, "hdl-64e", ScanPattern::kSpinning, 360.0F, -24.9F, 2.0F, 0.9F, 120.0F, 64,
     133312, 10.0F},
    {SensorKind::kVlp16, "vlp-16", ScanPattern::kSpinning, 360.0F, -15.0F, 15.0F, 0.5F, 100.0F, 16,
     28928, 10.0F},
    {SensorKind::kOs1_64, "os1-64", ScanPattern::kSpinning, 360.0F, -22.5F, 22.5F, 0.8F, 120.0F, 64,
     65536, 10.0F},
    {SensorKind::kOs2_128, "os2-128", ScanPattern::kSpinning, 360.0F, -11.25F, 11.25F, 1.0F, 240.0F,
     128, 131072, 10.0F},
    {SensorKind::kAevaAeries2, "aeva-aeries2", ScanPattern::kRaster, 120.0F, -9.6F, 9.6F, 1.0F,
     400.0F, 64, 64000, 10.0F},
    {SensorKind::kLivoxAvia, "livox-avia", ScanPattern::kNonRepetitive, 70.4F, -38.6F, 38.6F, 1.0F,
     450.0F, 0, 24000, 10.0F},
    {SensorKind::kLivoxMid360, "livox-mid-360", ScanPattern::kNonRepetitive, 360.0F, -7.0F, 52.0F,
     0.1F, 70.0F, 0, 20000, 10.0F},
}};

struct Alias {
  std::string_view name;  // lower case letters and digits only
  SensorKind kind;
};

constexpr std::array kAliases{
    Alias{"generic", SensorKind::kGeneric},
    Alias{"hdl64e", SensorKind::kHdl64e},
    Alias{"hdl64", SensorKind::kHdl64e},
    Alias{"velodynehdl64e", SensorKind::kHdl64e},
    Alias{"kitti", SensorKind::kHdl64e},
    Alias{"vlp16", SensorKind::kVlp16},
    Alias{"velodyne", SensorKind::kVlp16},
    Alias{"velodynevlp16", SensorKind::kVlp16},
    Alias{"os164", SensorKind::kOs1_64},
    Alias{"ousteros164", SensorKind::kOs1_64},
    Alias{"os1", SensorKind::kOs1_64},
    Alias{"os2128", SensorKind::kOs2_128},
    Alias{"ousteros2128", SensorKind::kOs2_128},
    Alias{"os2", SensorKind::kOs2_128},
    Alias{"ouster", SensorKind::kOs2_128},
    Alias{"aeva", SensorKind::kAevaAeries2},
    Alias{"aevaaeries2", SensorKind::kAevaAeries2},
    Alias{"aevaaeriesii", SensorKind::kAevaAeries2},
    Alias{"aeries2", SensorKind::kAevaAeries2},
    Alias{"aeriesii", SensorKind::kAevaAeries2},
    Alias{"avia", SensorKind::kLivoxAvia},
    Alias{"livoxavia", SensorKind::kLivoxAvia},
    Alias{"mid360", SensorKind::kLivoxMid360},
    Alias{"livoxmid360", SensorKind::kLivoxMid360},
};

/// Compares `alias` with `name`, skipping all of `name` that is no letter or digit.
bool same_name(std::string_view alias, std::string_view name) noexcept {
  std::size_t at = 0;
  for (char c : name) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    const bool counts = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (!counts) continue;
    if (at == alias.size() || alias[at] != c) return false;
    ++at;
  }
  return at == alias.size();
}

}  // namespace

Error SensorModel::validate() const noexcept {
  // False for NaN too.
  const auto within = [](float value, float low, float high) {
    return value >= low && value <= high;
  };
  const auto invalid = [](const char* message) {
    return Error{ErrorCode::kInvalidConfig, message};
  };
  if (!within(horizontal_fov_deg, 10.0F, 360.0F)) {
    return invalid("sensor.horizontal_fov_deg must be 10 to 360 degrees");
  }
  if (!within(elevation_min_deg, -90.0F, 90.0F) || !within(elevation_max_deg, -90.0F, 90.0F) ||
      elevation_max_deg - elevation_min_deg < 1.0F) {
    return invalid(
        "sensor.elevation_min_deg must be at least 1 degree below elevation_max_deg, both -90 to "
        "90 degrees");
  }
  if (!within(range_min_m, 0.0F, 500.0F) || !within(range_max_m, 0.0F, 500.0F) ||
      range_min_m >= range_max_m) {
    return invalid("sensor.range_min_m must be below range_max_m, both 0 to 500 metres");
  }
  if (pattern == ScanPattern::kSpinning && (rings < 2 || rings > 1024)) {
    return invalid("sensor.rings must be 2 to 1024 for a spinning sensor");
  }
  if (points_per_scan < 100 || points_per_scan > 3300000) {
    return invalid("sensor.points_per_scan must be 100 to 3300000");
  }
  if (!(scan_rate_hz > 0.0F && scan_rate_hz <= 200.0F)) {
    return invalid("sensor.scan_rate_hz must be above 0 and at most 200 Hz");
  }
  return {};
}

std::span<const SensorModel> sensor_models() noexcept { return kModels; }

const SensorModel& sensor_model(SensorKind kind) noexcept {
  return kModels[static_cast<std::size_t>(kind)];
}

const SensorModel* find_sensor(std::string_view name) noexcept {
  for (const Alias& alias : kAliases) {
    if (same_name(alias.name, name)) return &sensor_model(alias.kind);
  }
  return nullptr;
}

}  // namespace unimapper
