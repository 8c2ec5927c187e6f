// Plausibility of a recording, told to the user before it is mapped.
#include "src/apps/onboard/input_check.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "src/apps/onboard/setup.hpp"
#include "src/apps/print.hpp"
#include "src/core/calibration.hpp"
#include "src/input/extrinsic.hpp"
#include "src/input/motion_findings.hpp"
#include "src/input/plausibility.hpp"
#include "src/input/text.hpp"

namespace unimapper::apps {

void print_warning(const input::Finding& finding) {
  print_to(stderr, "onboard: warning: input, {}: {}\n", finding.check, finding.message);
}

nlohmann::ordered_json findings_json(const std::vector<input::Finding>& findings) {
  using Json = nlohmann::ordered_json;
  Json list = Json::array();
  const auto limit = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
  for (const input::Finding& finding : findings) {
    list.push_back({{"check", finding.check},
                    {"severity", input::severity_name(finding.severity)},
                    {"figure", std::round(finding.figure * 1e3) / 1e3},
                    {"unit", finding.unit},
                    {"suspicious_above", limit(finding.limits.suspicious)},
                    {"wrong_above", limit(finding.limits.wrong)},
                    {"message", finding.message}});
  }
  return {{"severity", input::severity_name(input::worst(findings))}, {"findings", list}};
}

input::GivenCorrection OpenedInput::correction() const {
  input::GivenCorrection given{std::nullopt, how.time_offset_s};
  // One of several LiDARs, or one that the recording mounts, has no mount that could be named.
  const bool is_named = how.T_base_lidar.size() == 1 ||
                        (how.T_base_lidar.empty() && !dataset->is_mounted_by_recording());
  if (!is_named) return given;
  given.T_base_lidar =
      (how.T_base_lidar.empty() ? Pose() : how.T_base_lidar[0]) * how.T_given_lidar;
  return given;
}

namespace {

/// Corrects `how` by what is sure; false where nothing is.
bool correct(const input::Plausibility& found, datasets::OpenOptions& how) {
  const datasets::OpenOptions before = how;
  if (how.finds_mount) {
    // A body that is upright is a mistake in the mount, and known.
    how.turns_over = how.turns_over ||
                     (found.up == input::Side::kBelow &&
                      !input::has_known_mistake(found.agreement) && found.mistake.names.empty());
    how.T_given_lidar = how.T_given_lidar * found.calibration.sure_mount();
  }
  if (how.finds_time_offset) how.time_offset_s -= found.calibration.sure_delay_s();
  return how.turns_over != before.turns_over || how.time_offset_s != before.time_offset_s ||
         how.T_given_lidar.translation != before.T_given_lidar.translation ||
         how.T_given_lidar.rotation != before.T_given_lidar.rotation;
}

std::vector<std::string> in_words(const OpenedInput& opened, const Calibration& known) {
  std::vector<std::string> words;
  if (opened.how.turns_over) words.push_back("poses are upside down and were turned over");
  if (opened.how.finds_mount) {
    const auto mount = opened.correction().T_base_lidar;
    words.push_back((mount ? "--extrinsic " + input::extrinsic_text(*mount) + " is used"
                           : "the mount is corrected, behind the recording's own, by " +
                                 input::extrinsic_text(opened.how.T_given_lidar)) +
                    (known.shows_rotation() ? "" : "; the motion does not show yaw and pitch") +
                    (known.shows_lever_arm() ? "" : "; the motion does not show the lever arm"));
  }
  if (opened.how.finds_time_offset) {
    words.push_back(input::text("--time-offset %.3f is used", opened.how.time_offset_s) +
                    (known.shows_delay() ? "" : "; the motion does not show a delay"));
  }
  return words;
}

/// What the reader guessed of the LiDAR's place comes before what follows from a wrong guess.
std::string reason_of_reader(const datasets::Dataset& dataset, const input::Finding& refusal) {
  std::string reason;
  if (refusal.check != "motion" && refusal.check != "axes" && refusal.check != "mount")
    return reason;
  for (const datasets::Note& note : dataset.notes()) {
    if (note.is_about_mounting)
      reason += note.text + "; by this guess scans and poses do not fit: ";
  }
  return reason;
}

}  // namespace

OpenedInput open_input(const OnboardOptions& options) {
  OpenedInput opened;
  opened.how = open_options(options);
  opened.dataset = datasets::open_dataset(options.dataset, opened.how);
  if (!opened.how.finds_mount && !opened.how.finds_time_offset) return opened;
  constexpr int kMostRounds = 3;  // registration starts from the poses as corrected so far
  Calibration calibration;
  for (int round = 0; round < kMostRounds; ++round) {
    const input::Plausibility found = input::examine(*opened.dataset, options.scans);
    if (round == 0) calibration = found.calibration;
    if (!correct(found, opened.how)) break;
    opened.dataset = datasets::open_dataset(options.dataset, opened.how);
  }
  opened.corrections = in_words(opened, calibration);
  for (const std::string& text : opened.corrections) {
    print_to(stderr, "onboard: input: {}\n", text);
  }
  return opened;
}

CheckedInput check_input(const OnboardOptions& options, const OpenedInput& opened) {
  input::Plausibility found = input::examine(*opened.dataset, options.scans, opened.correction());
  std::vector<input::Finding>& findings = found.findings;
  const input::Finding* refusal = nullptr;
  std::string forced;
  for (const input::Finding& finding : findings) {
    if (finding.severity == input::Severity::kFine) continue;
    const bool is_wrong = finding.severity == input::Severity::kWrong;
    if (is_wrong && options.force) forced += (forced.empty() ? "" : ", ") + finding.check;
    if (is_wrong && !options.force && refusal == nullptr) {
      refusal = &finding;
    } else {
      print_warning(finding);
    }
  }
  if (refusal != nullptr) {
    throw std::runtime_error(options.dataset.string() + ": " +
                             reason_of_reader(*opened.dataset, *refusal) + refusal->check + ": " +
                             refusal->message + " (--force maps it as it is)");
  }
  for (const std::string& text : opened.corrections) {
    findings.push_back({"correction", input::Severity::kFine, 0.0, {}, text});
  }
  if (!forced.empty()) {
    findings.push_back({kForced,
                        input::Severity::kSuspicious,
                        0.0,
                        {},
                        "mapped as it is by --force, though surely wrong: " + forced});
  }
  return {std::move(findings), found.sensor, std::move(found.steps.breaks)};
}

std::optional<input::Finding> check_repeated_clouds(const datasets::Dataset& dataset,
                                                    const std::vector<std::size_t>& repeated,
                                                    std::size_t scans) {
  if (repeated.empty()) return std::nullopt;
  return input::Finding{
      "repeated clouds", input::Severity::kSuspicious,
      100.0 * static_cast<double>(repeated.size()) / static_cast<double>(scans), "%",
      input::text("%zu of %zu scans repeat the one before point by point although the robot moved, "
                  "and are left out; the first is %s: was the driver or its sensor stuck?",
                  repeated.size(), scans, dataset.scan_name(repeated.front()).c_str())};
}

std::optional<input::Finding> check_dynamic_share(double share, std::uint64_t scans) {
  // Measured: 0.05 to 25 % in right runs, above 49 % where poses or points were wrong.
  constexpr double kMost = 0.4;
  constexpr std::uint64_t kFewest = 5;
  if (share <= kMost || scans < kFewest) return std::nullopt;
  return input::Finding{
      "dynamic share", input::Severity::kSuspicious, 100.0 * share, "%",
      input::text(
          "%.0f %% of the points are dynamic, more than scenes show: likely causes are "
          "poses that are not those of the scans (order, stamps, convention, frame), points "
          "that are not compensated for the motion, or the wrong --sensor; unimapper "
          "inspect says more",
          100.0 * share)};
}

}  // namespace unimapper::apps
