#include "src/apps/onboard/setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "ports/datasets/files.hpp"
#include "src/apps/onboard/progress.hpp"
#include "src/apps/onboard/sensor_mode.hpp"
#include "src/apps/suggestion.hpp"
#include "src/input/plausibility.hpp"
#include "src/input/sensor_sheets.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/onboard/surroundings.hpp"

namespace unimapper::apps {

namespace {

std::int64_t steady_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

const input::SensorSheet& require_sensor(const std::string& name, const std::string& source) {
  if (const input::SensorSheet* sheet = input::find_sheet(name)) return *sheet;
  const std::vector<std::string> known = input::sensor_names();
  throw std::runtime_error(source + ": unknown sensor '" + name + "'" + did_you_mean(name, known) +
                           "; known are " + joined(known) + "; others by --sensor-file");
}

}  // namespace

std::optional<std::string> recorded_sensor(const std::filesystem::path& dataset) {
  const std::filesystem::path file = dataset / "dataset.json";
  if (!std::filesystem::exists(file)) return std::nullopt;
  const auto json = nlohmann::json::parse(datasets::read_file(file), nullptr, false);
  if (!json.is_object()) throw std::runtime_error(file.string() + ": is not a JSON object");
  const auto entry = json.find("sensor");
  if (entry == json.end()) return std::nullopt;
  if (!entry->is_string()) throw std::runtime_error(file.string() + ": sensor: must be a string");
  return entry->get<std::string>();
}

namespace {

ChosenSensor named(const input::SensorSheet& sheet, const std::string& source,
                   const input::SensorFigures& figures) {
  return {sheet.model, source, {input::check_sensor(figures, sheet)}};
}

}  // namespace

namespace {

/// A line on stderr while the own odometry reads the scans.
std::function<void(std::size_t, std::size_t)> odometry_progress() {
  auto progress = std::make_shared<std::optional<Progress>>();
  return [progress](std::size_t done, std::size_t all) {
    if (!*progress) progress->emplace("odometry", all);
    (*progress)->update(done, "registered");
    if (done == all) progress->reset();
  };
}

}  // namespace

datasets::OpenOptions open_options(const OnboardOptions& options) {
  datasets::OpenOptions result = options.input;
  if (options.scans < std::numeric_limits<std::size_t>::max()) result.most_scans = options.scans;
  result.odometry_progress = odometry_progress();
  if (options.sensor_file.empty() || !result.T_base_lidar.empty()) return result;
  const input::SensorSheet sheet = input::read_sheet(options.sensor_file);
  if (sheet.T_base_lidar) result.T_base_lidar.push_back(*sheet.T_base_lidar);
  return result;
}

ChosenSensor choose_sensor(const OnboardOptions& options, const std::string& implied,
                           const input::SensorFigures& figures) {
  if (!options.sensor_file.empty()) {
    return named(input::read_sheet(options.sensor_file), "from --sensor-file", figures);
  }
  if (!options.input.sensor.empty()) {
    return named(require_sensor(options.input.sensor, "--sensor"), "from --sensor", figures);
  }
  if (const auto recorded = recorded_sensor(options.dataset)) {
    const std::string file = (options.dataset / "dataset.json").string();
    return named(require_sensor(*recorded, file), "from dataset.json", figures);
  }
  if (!implied.empty()) {
    ChosenSensor chosen =
        named(require_sensor(implied, "format"), "from the format; --sensor overrides", figures);
    if (chosen.findings[0].severity == input::Severity::kFine) return chosen;
  }
  const std::vector<input::SensorMatch> matches = input::match_sensors(figures);
  if (figures.points > 0 && input::is_recognised(matches)) {
    return {matches[0].sheet->model, "recognised from the points; --sensor overrides", {}};
  }
  return {input::generic_for(figures), "the recording names none; --sensor overrides", {}};
}

namespace {

Computer computer_of(const std::string& name) {
  if (name == "default") return Computer::kServer;
  if (name == "jetson") return Computer::kJetson;
  if (name == "raspberry-pi") return Computer::kRaspberryPi;
  if (name == "armv7-64mb") return Computer::kArmv7With64Mb;
  throw std::runtime_error(
      "--preset must be default, paper, jetson, raspberry-pi or armv7-64mb, not '" + name + "'");
}

PipelineConfig start_from(const std::string& name, const SensorModel& sensor,
                          std::uint32_t columns) {
  const SensorModel& known = sensor_model(sensor.kind);
  const bool is_known =
      known.name == sensor.name && known.points_per_scan == sensor.points_per_scan;
  if (name == "paper") {
    if (is_known) return paper_preset(sensor.kind);
    throw std::runtime_error("--preset paper has no parameters for the sensor " +
                             std::string(sensor.name) + "; --sensor generic takes any");
  }
  const Computer computer = computer_of(name);
  if (is_known) return preset(sensor.kind, computer, columns);
  SensorModel model = sensor;
  if (columns > 0 && model.rings > 0) model.points_per_scan = columns * model.rings;
  const auto config = preset(model, computer);
  if (!config.ok()) throw std::runtime_error(config.error().message);
  return config.value();
}

}  // namespace

std::string_view surroundings_name(Surroundings surroundings) {
  constexpr std::array<std::string_view, 2> kNames = {"outdoors", "indoors"};
  return kNames.at(static_cast<std::size_t>(surroundings));
}

namespace {

void estimate_surroundings(const datasets::Dataset& dataset, std::size_t scans, FirstScans& first) {
  SurroundingsEstimator estimator;
  datasets::Scan scan;
  for (std::size_t i = 0; i < scans; ++i) {
    dataset.read_scan(i, scan);
    estimator.add(scan.view());
  }
  const SurroundingsEstimate estimate = estimator.estimate();
  first.surroundings = estimate.surroundings;
  first.source = "too few points to tell";
  if (estimate.scans == 0) return;
  const std::string source = fmt::format(
      "99 % of the points of {} scans within {:.1f} m{}; {}", estimate.scans, estimate.extent_m,
      estimate.sees_all_round ? "" : ", not in all directions", "--surroundings overrides");
  first.source = source;
  first.extent_m = estimate.extent_m;
}

}  // namespace

FirstScans look_at_first_scans(const OnboardOptions& options, const datasets::Dataset& dataset,
                               const SensorModel& sensor, const input::SensorFigures& figures) {
  const std::size_t scans =
      std::min<std::size_t>({SurroundingsEstimator::kScans, options.scans, dataset.scan_count()});
  FirstScans first;
  first.copies = figures.copies;
  first.up_sigma_deg = dataset.up_sigma_deg();
  first.recorded_points = figures.recorded_points;
  if (scans > 1) {
    const double lasted_ns =
        static_cast<double>(dataset.stamp_ns(scans - 1)) - static_cast<double>(dataset.stamp_ns(0));
    first.scan_interval_s = static_cast<float>(1e-9 * lasted_ns / static_cast<double>(scans - 1));
  }
  const bool paper = options.preset == "paper";
  if (!paper) first.columns = recorded_columns(dataset, sensor);
  if (options.surroundings != "auto") {
    first.source = "from --surroundings";
    if (options.surroundings == "indoors") first.surroundings = Surroundings::kIndoors;
  } else if (paper) {
    first.source = "the paper's preset";
  } else {
    estimate_surroundings(dataset, scans, first);
  }
  return first;
}

PipelineConfig make_config(const OnboardOptions& options, const SensorModel& sensor,
                           const FirstScans& first) {
  PipelineConfig config = adapt_to(
      first.surroundings, start_from(options.preset, sensor, first.columns), first.scan_interval_s);
  if (first.copies > kNotedCopies) {
    // Both returns of all rays are at most twice as many; a quarter more than what was looked at.
    std::uint32_t& points = config.keyframe.max_points_per_scan;
    const std::size_t wanted = first.recorded_points + first.recorded_points / 4;
    points =
        std::max(points, static_cast<std::uint32_t>(std::min<std::size_t>(wanted, 2 * points)));
  }
  config.odometry.up_sigma_deg = static_cast<float>(first.up_sigma_deg);
  config.deferred = options.deferred;
  config.intensity = options.intensity || (options.publish.empty() && options.spool.empty());
  config.clock_ns = &steady_clock_ns;  // before the file is read: a budget in it needs a clock
  if (!options.config.empty()) {
    parse_config(datasets::read_file(options.config), options.config.string(), config);
  }
  config.intensity = config.intensity || options.intensity;
  return config;
}

std::string effective_config(const OnboardOptions& options) {
  if (options.dataset.empty()) {
    FirstScans none;
    if (options.surroundings == "indoors") none.surroundings = Surroundings::kIndoors;
    return dump_config(make_config(options, choose_sensor(options, {}, {}).model, none));
  }
  const auto dataset = datasets::open_dataset(options.dataset, open_options(options));
  const input::SensorFigures figures = input::examine(*dataset, options.scans).sensor;
  const SensorModel sensor = choose_sensor(options, dataset->sensor(), figures).model;
  return dump_config(
      make_config(options, sensor, look_at_first_scans(options, *dataset, sensor, figures)));
}

}  // namespace unimapper::apps
