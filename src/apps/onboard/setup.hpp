// Choice of sensor and parameters of a run.
#pragma once

#include <optional>
#include <string>

#include "ports/datasets/dataset.hpp"
#include "src/apps/onboard/options.hpp"
#include "unimapper/core/sensor.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::apps {

/// A LiDAR and where its name was found.
struct ChosenSensor {
  const SensorModel* model = nullptr;
  std::string source;  ///< for the user, e.g. "--sensor"
};

/// The LiDAR that DATASET/dataset.json names ({"sensor": "os2-128"}); empty where the file or
/// the entry is not there. Throws std::runtime_error for a damaged file.
std::optional<std::string> recorded_sensor(const std::filesystem::path& dataset);

/// The LiDAR named by --sensor, else by dataset.json, else implied by the format (`implied`),
/// else the generic one. Throws std::runtime_error for an unknown name.
ChosenSensor choose_sensor(const OnboardOptions& options, const std::string& implied);

/// The chosen preset for the sensor, with the configuration file on top. Throws
/// std::runtime_error for an unknown preset or a wrong file.
PipelineConfig make_config(const OnboardOptions& options, SensorKind sensor);

}  // namespace unimapper::apps
