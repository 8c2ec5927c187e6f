// Sensors of the C interface: names, data sheets, and what they need.
#include <cstddef>
#include <cstdint>

#include "ports/c/config.hpp"
#include "ports/c/unimapper.h"
#include "unimapper/core/sensor.hpp"
#include "unimapper/onboard/config.hpp"

using namespace unimapper;
using namespace unimapper::c;

namespace {

/// What a data sheet says, if this library can read it; whether it can be right is not looked at.
ConfigStatus read_model(const um_sensor_model* model, SensorModel& sensor) noexcept {
  if (model == nullptr) return {UM_NULL_ARGUMENT, um_status_text(UM_NULL_ARGUMENT)};
  if (model->pattern > UM_SCAN_NON_REPETITIVE) {
    return {UM_INVALID_CONFIG, "model.pattern must be one of enum um_scan_pattern"};
  }
  sensor.pattern = static_cast<ScanPattern>(model->pattern);
  sensor.horizontal_fov_deg = model->horizontal_fov_deg;
  sensor.elevation_min_deg = model->elevation_min_deg;
  sensor.elevation_max_deg = model->elevation_max_deg;
  sensor.range_min_m = model->range_min_m;
  sensor.range_max_m = model->range_max_m;
  sensor.rings = model->rings;
  sensor.points_per_scan = model->points_per_scan;
  sensor.scan_rate_hz = model->scan_rate_hz;
  return {};
}

ConfigStatus fit_of(const um_config* config, const SensorModel& sensor, um_sensor_fit* out) {
  if (out == nullptr) return {UM_NULL_ARGUMENT, um_status_text(UM_NULL_ARGUMENT)};
  PipelineConfig read;
  const ConfigStatus status = read_config(config, read);
  if (status.status != UM_OK) return status;
  const SensorFit fit = sensor_fit(sensor, read);
  *out = {fit.fits() ? 1U : 0U, fit.cells_needed, fit.cells, fit.range_m};
  return {};
}

}  // namespace

extern "C" {

um_status um_sensor_find(const char* name, std::uint32_t* sensor) {
  if (name == nullptr || sensor == nullptr) return UM_NULL_ARGUMENT;
  const SensorModel* const model = find_sensor(name);
  if (model == nullptr) return UM_UNKNOWN_SENSOR;
  *sensor = static_cast<std::uint32_t>(model->kind);
  return UM_OK;
}

um_status um_config_from_model(um_config* config, const um_sensor_model* model,
                               std::uint32_t computer, const char** message) {
  SensorModel sensor;
  const ConfigStatus read = read_model(model, sensor);
  if (read.status != UM_OK) return say(read.status, read.message, message);
  if (computer > UM_COMPUTER_ARMV7_WITH_64_MB) {
    return say(UM_UNKNOWN_COMPUTER, um_status_text(UM_UNKNOWN_COMPUTER), message);
  }
  const Expected<PipelineConfig> found = preset(sensor, static_cast<Computer>(computer));
  if (!found.ok()) return say(UM_INVALID_CONFIG, found.error().message, message);
  const um_status status = init_config(*found, config);
  return say(status, status == UM_OK ? "" : um_status_text(status), message);
}

um_status um_sensor_fit_get(const um_config* config, std::uint32_t sensor, um_sensor_fit* fit) {
  if (sensor >= sensor_models().size()) return UM_UNKNOWN_SENSOR;
  return fit_of(config, sensor_model(static_cast<SensorKind>(sensor)), fit).status;
}

um_status um_sensor_fit_from_model(const um_config* config, const um_sensor_model* model,
                                   um_sensor_fit* fit, const char** message) {
  SensorModel sensor;
  ConfigStatus status = read_model(model, sensor);
  if (status.status == UM_OK) {
    const Error invalid = sensor.validate();
    status = invalid.ok() ? fit_of(config, sensor, fit)
                          : ConfigStatus{UM_INVALID_CONFIG, invalid.message};
  }
  return say(status.status, status.message, message);
}

}  // extern "C"
