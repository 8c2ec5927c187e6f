// Plausibility of a recording, told to the user before it is mapped.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/apps/onboard/onboard_options.hpp"
#include "src/input/finding.hpp"
#include "src/input/odometry_breaks.hpp"
#include "src/input/plausibility.hpp"
#include "src/input/recognition.hpp"

namespace unimapper::apps {

/// What was found, and what the points say of the sensor.
struct CheckedInput {
  std::vector<input::Finding> findings;
  input::SensorFigures sensor;
  std::vector<input::OdometryBreak> breaks;  ///< where the scans contradict the odometry
};

/// Name of the finding that the recording was mapped though others refuse it.
inline constexpr const char* kForced = "forced";

/// A recording and how it was opened.
struct OpenedInput {
  std::unique_ptr<datasets::Dataset> dataset;
  datasets::OpenOptions how;  ///< with what --extrinsic auto and --time-offset auto found
  std::vector<std::string> corrections;  ///< by what was found, in words
  /// What its poses have of a mount and an offset.
  [[nodiscard]] input::GivenCorrection correction() const;
};

/// Opens the recording; for --extrinsic auto and --time-offset auto examines it, says what was
/// found, and opens it anew. Throws DatasetError.
OpenedInput open_input(const OnboardOptions& options);

/// Examines the recording and prints what is unusual. Throws std::runtime_error with the remedy
/// where it is surely wrong and --force was not given.
CheckedInput check_input(const OnboardOptions& options, const OpenedInput& opened);

/// Scans, `repeated` of the first `scans`, that repeat the one before although the robot moved;
/// empty without any.
[[nodiscard]] std::optional<input::Finding> check_repeated_clouds(
    const datasets::Dataset& dataset, const std::vector<std::size_t>& repeated, std::size_t scans);

/// A share of dynamic points, [0, 1], that no scene shows. Empty where scenes do.
std::optional<input::Finding> check_dynamic_share(double share, std::uint64_t scans);

/// Severity of the worst, and all with their figures and limits (null: none).
[[nodiscard]] nlohmann::ordered_json findings_json(const std::vector<input::Finding>& findings);

/// One line on stderr.
void print_warning(const input::Finding& finding);

}  // namespace unimapper::apps
