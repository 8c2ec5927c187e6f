// Choice of sensor and parameters of a run.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/apps/onboard/onboard_options.hpp"
#include "src/input/finding.hpp"
#include "src/input/recognition.hpp"
#include "unimapper/core/sensor.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::apps {

/// A LiDAR and where its name was found.
struct ChosenSensor {
  SensorModel model;
  std::string source;                    ///< for the user, e.g. "--sensor"
  std::vector<input::Finding> findings;  ///< where name and points contradict each other
};

/// The LiDAR that DATASET/dataset.json names ({"sensor": "os2-128"}); empty where the file or
/// the entry is not there. Throws std::runtime_error for a damaged file.
std::optional<std::string> recorded_sensor(const std::filesystem::path& dataset);

/// The options of `options.input`, and where the data sheet of --sensor-file says that the LiDAR is
/// mounted, unless --extrinsic does. Throws std::runtime_error for a damaged sheet.
datasets::OpenOptions open_options(const OnboardOptions& options);

/// The LiDAR of --sensor-file, else named by --sensor, else by dataset.json, else implied by the
/// format (`implied`) if the points do not contradict, else the one that the points (`figures`)
/// look like, else the generic one with room for them. Throws std::runtime_error for an unknown
/// name and for a damaged sheet.
ChosenSensor choose_sensor(const OnboardOptions& options, const std::string& implied,
                           const input::SensorFigures& figures);

/// What the first scans of a recording say of the parameters that suit it.
struct FirstScans {
  Surroundings surroundings = Surroundings::kOutdoors;
  std::string source;            ///< of the surroundings, for the user, e.g. "--surroundings"
  float extent_m = 0.0F;         ///< as in `SurroundingsEstimate`; 0: nothing was measured
  float scan_interval_s = 0.1F;  ///< between scans
  double up_sigma_deg = 0.0;     ///< as of the dataset
  std::uint32_t columns = 0;     ///< of the sensor's mode; 0: as its data sheet says
  double copies = 1.0;           ///< how often points are published, as in `input::SensorFigures`
  std::size_t recorded_points = 0;  ///< of the fullest scan that was looked at, all
};

/// From so many copies on there is room for them, and they are said.
constexpr double kNotedCopies = 1.01;

/// The name of surroundings: "indoors" or "outdoors".
[[nodiscard]] std::string_view surroundings_name(Surroundings surroundings);

/// Looks at the first scans of `dataset`, whose points say `figures`. --surroundings overrides what
/// they say; the paper's preset knows outdoors and the data sheet only.
FirstScans look_at_first_scans(const OnboardOptions& options, const datasets::Dataset& dataset,
                               const SensorModel& sensor, const input::SensorFigures& figures);

/// The chosen preset for the sensor and for what its first scans say, with room for points that are
/// published twice, and the configuration file on top. Throws std::runtime_error for an unknown
/// preset or a wrong file.
PipelineConfig make_config(const OnboardOptions& options, const SensorModel& sensor,
                           const FirstScans& first);

}  // namespace unimapper::apps
