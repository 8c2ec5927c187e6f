// `unimapper inspect`: what a recording is, what was guessed about it and what is unusual.
#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/readers.hpp"
#include "ports/store/store_file.hpp"
#include "src/apps/base/base_options.hpp"
#include "src/apps/commands.hpp"
#include "src/apps/input_options.hpp"
#include "src/apps/onboard/input_check.hpp"
#include "src/apps/onboard/onboard_options.hpp"
#include "src/apps/onboard/setup.hpp"
#include "src/apps/print.hpp"
#include "src/core/calibration.hpp"
#include "src/input/plausibility.hpp"
#include "src/input/text.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

struct InspectOptions {
  OnboardOptions onboard;
  bool json = false;
  bool check = false;
};

double rounded(double value) { return std::round(value * 1e3) / 1e3; }

std::string format_name(const InspectOptions& options) {
  const std::string& given = options.onboard.input.format;
  if (given != "auto") return given;
  return std::string(datasets::recognise(options.onboard.dataset).name);
}

Json describe(const InspectOptions& options, const datasets::Dataset& dataset,
              const input::Plausibility& found, const ChosenSensor& sensor) {
  Json json;
  json["format"] = {{"name", format_name(options)},
                    {"from", options.onboard.input.format == "auto" ? "its files" : "--format"}};
  json["scans"] = dataset.scan_count();
  const double looked_at = static_cast<double>(std::max<std::size_t>(1, found.ranges.scans));
  json["points_per_scan"] = {
      {"mean", std::round(static_cast<double>(found.ranges.points) / looked_at)},
      {"most_valid", found.sensor.points}};
  json["sensor"] = {{"name", sensor.model.name}, {"from", sensor.source}};
  Json& nearest = json["sensor"]["nearest"] = Json::array();
  const auto matches = input::match_sensors(found.sensor);
  for (std::size_t i = 0; i < std::min<std::size_t>(3, matches.size()); ++i) {
    nearest.push_back({{"name", matches[i].sheet->model.name},
                       {"columns", matches[i].columns},
                       {"distance", rounded(matches[i].distance)}});
  }
  const auto& s = found.sensor;
  const double columns =
      s.ray_spacing_deg > 0.0 ? std::round(s.width_deg / s.ray_spacing_deg) : 0.0;
  json["sampling"] = {{"rings_recorded", s.rings},
                      {"ring_spacing_deg", rounded(s.ring_spacing_deg)},
                      {"ray_spacing_deg", rounded(s.ray_spacing_deg)},
                      {"columns", columns},
                      {"elevation_deg", {rounded(s.lowest_deg), rounded(s.highest_deg)}},
                      {"width_deg", rounded(s.width_deg)}};
  json["range_m"] = {{"median", rounded(found.ranges.median_m)},
                     {"within_99_percent", rounded(found.ranges.largest_m)},
                     {"farthest", rounded(s.farthest_m)}};
  json["invalid_points"] = rounded(found.ranges.not_finite + found.ranges.at_origin);
  json["up"] = {{"path_below_m", found.driven.below.level},
                {"path_above_m", found.driven.above.level}};
  const auto& m = found.motion;
  json["motion"] = {{"rate_hz", m.interval_s > 0.0 ? rounded(1.0 / m.interval_s) : 0.0},
                    {"duration_s", rounded(m.duration_s)},
                    {"path_m", rounded(m.path_m)},
                    {"speed_mps", rounded(m.speed_mps)},
                    {"gaps", m.gaps},
                    {"longest_gap_s", rounded(m.longest_gap_s)},
                    {"jumps", m.jumps}};
  const auto& a = found.agreement;
  json["agreement"] = {{"pairs", a.pairs},
                       {"given", rounded(a.given)},
                       {"registered", rounded(a.registered)},
                       {"without_motion", rounded(a.identity)},
                       {"disjoint_pairs", a.disjoint_pairs},
                       {"correction_m", rounded(a.correction_m)},
                       {"correction_deg", rounded(a.correction_deg)},
                       {"mistake", a.mistake},
                       {"mistake_undone", rounded(a.mistaken)},
                       {"ring_gain", rounded(a.ring_gain)}};
  json["odometry"] = {{"steps_compared", found.steps.steps_told},
                      {"pairs", found.steps.compared},
                      {"contradicted", found.steps.contradicted}};
  const auto& c = found.calibration;
  const auto estimate = [](const Estimate& e) {
    return Json::array({rounded(e.value), rounded(e.sigma)});
  };
  json["calibration"] = {{"motions", c.motions},
                         {"roll_deg", estimate(c.roll_deg)},
                         {"pitch_deg", estimate(c.pitch_deg)},
                         {"yaw_deg", estimate(c.yaw_deg)},
                         {"x_m", estimate(c.x_m)},
                         {"y_m", estimate(c.y_m)},
                         {"z_m", estimate(c.z_m)},
                         {"delay_s", estimate(c.delay_s)}};
  Json& notes = json["notes"] = Json::array();
  for (const datasets::Note& note : dataset.notes()) notes.push_back(note.text);
  std::vector<input::Finding> findings = found.findings;
  findings.insert(findings.end(), sensor.findings.begin(), sensor.findings.end());
  Json all = findings_json(findings);
  json["severity"] = all["severity"];
  Json& unusual = json["findings"] = Json::array();
  for (const Json& finding : all["findings"]) {
    if (finding["severity"] != "fine") unusual.push_back(finding);
  }
  json["checks"] = std::move(all["findings"]);
  return json;
}

std::string words(const Json& json) { return json.get<std::string>(); }

double number(const Json& json) { return json.get<double>(); }

void print(const Json& json) {
  const auto line = [](const char* title, const std::string& value) {
    print_to(stdout, "{:<10} {}\n", title, value);
  };
  using input::text;
  line("format", words(json["format"]["name"]) + " (from " + words(json["format"]["from"]) + ")");
  line("scans", text("%.0f, %.0f points each", number(json["scans"]),
                     number(json["points_per_scan"]["mean"])));
  std::string nearest;
  for (const Json& match : json["sensor"]["nearest"]) {
    nearest += (nearest.empty() ? "" : ", ") + words(match["name"]) +
               text(" (%.2f)", number(match["distance"]));
  }
  line("sensor", words(json["sensor"]["name"]) + " (" + words(json["sensor"]["from"]) +
                     "); nearest data sheets: " + nearest);
  const Json& s = json["sampling"];
  const bool rings = number(s["ring_spacing_deg"]) > 0.0;
  line("rays", text("%.1f to %.1f degrees high, %.0f degrees wide", number(s["elevation_deg"][0]),
                    number(s["elevation_deg"][1]), number(s["width_deg"])) +
                   (rings ? text("; rings %.2f degrees apart, about %.0f columns",
                                 number(s["ring_spacing_deg"]), number(s["columns"]))
                          : "; no rings found") +
                   (number(s["rings_recorded"]) > 0
                        ? text("; %.0f rings recorded", number(s["rings_recorded"]))
                        : ""));
  line("range",
       text("%.1f m (median), 99 %% within %.1f m, farthest %.1f m; %.1f %% invalid",
            number(json["range_m"]["median"]), number(json["range_m"]["within_99_percent"]),
            number(json["range_m"]["farthest"]), 100.0 * number(json["invalid_points"])));
  line("up", text("surfaces below the sensor's path along %.0f m, above it along %.0f m",
                  number(json["up"]["path_below_m"]), number(json["up"]["path_above_m"])));
  const Json& m = json["motion"];
  line("motion", text("%.1f m in %.1f s, %.2f m/s (median); %.1f scans/s, %.0f gaps (longest %.2f "
                      "s), %.0f jumps",
                      number(m["path_m"]), number(m["duration_s"]), number(m["speed_mps"]),
                      number(m["rate_hz"]), number(m["gaps"]), number(m["longest_gap_s"]),
                      number(m["jumps"])));
  const Json& a = json["agreement"];
  line("agreement",
       number(a["pairs"]) == 0.0
           ? std::string("unknown: no pair of scans shows walls")
           : text("%.0f %% of the points lie on surfaces of the scan before under the given poses, "
                  "%.0f %% after registration, %.0f %% without motion (%.0f pairs)",
                  100.0 * number(a["given"]), 100.0 * number(a["registered"]),
                  100.0 * number(a["without_motion"]), number(a["pairs"])));
  for (const Json& note : json["notes"]) line("note", words(note));
  for (const Json& finding : json["findings"]) {
    line(words(finding["severity"]).c_str(),
         words(finding["check"]) + ": " + words(finding["message"]));
  }
  if (json["findings"].empty()) line("findings", "nothing unusual");
}

void run_inspect(const InspectOptions& options) {
  if (store::is_store(options.onboard.dataset)) {
    return inspect_store(options.onboard.dataset, options.json, options.check);
  }
  const OpenedInput opened = open_input(options.onboard);
  const auto& dataset = opened.dataset;
  const input::Plausibility found =
      input::examine(*dataset, options.onboard.scans, opened.correction());
  const ChosenSensor sensor = choose_sensor(options.onboard, dataset->sensor(), found.sensor);
  const Json json = describe(options, *dataset, found, sensor);
  if (options.json) {
    std::cout << json.dump(2) << '\n';
  } else {
    print(json);
  }
}

}  // namespace

void register_inspect(CLI::App& app) {
  auto options = std::make_shared<InspectOptions>();
  CLI::App* command = app.add_subcommand(
      "inspect",
      "Say what a recording is, what was guessed about it and what is unusual; or what a store "
      "holds");
  command
      ->add_option("PATH", options->onboard.dataset,
                   "The recording, or a store of `unimapper base`")
      ->required();
  add_open_options(*command, options->onboard.input);
  add_sensor_file_option(*command, options->onboard.sensor_file);
  command->add_flag("--json", options->json, "The same as JSON");
  command->add_flag("--check", options->check,
                    "Of a store: read all of it, and say what is damaged");
  command->callback([options] { run_inspect(*options); });
}

}  // namespace unimapper::apps
