// Plausibility of a recording, told to the user before it is mapped.
#include "src/apps/onboard/input_check.hpp"

#include <cstdio>
#include <stdexcept>

#include "src/apps/onboard/setup.hpp"
#include "src/input/extrinsic.hpp"
#include "src/input/plausibility.hpp"
#include "src/input/text.hpp"

namespace unimapper::apps {

void print_warning(const input::Finding& finding) {
  std::fprintf(stderr, "onboard: warning: input, %s: %s\n", finding.check.c_str(),
               finding.message.c_str());
}

input::GivenCorrection OpenedInput::correction() const {
  const Pose base = how.T_base_lidar.empty() ? Pose() : how.T_base_lidar.front();
  return {base * how.T_given_lidar, how.time_offset_s};
}

namespace {

/// Corrects `opened.how` by what is sure and says so; false where nothing is.
bool correct(const input::Plausibility& found, OpenedInput& opened) {
  const datasets::OpenOptions before = opened.how;
  datasets::OpenOptions& how = opened.how;
  if (how.finds_mount) {
    how.turns_over = how.turns_over || input::is_upside_down(found.driven);
    how.T_given_lidar = how.T_given_lidar * found.calibration.sure_mount();
  }
  if (how.finds_time_offset) how.time_offset_s -= found.calibration.sure_delay_s();
  return how.turns_over != before.turns_over || how.time_offset_s != before.time_offset_s ||
         how.T_given_lidar.translation != before.T_given_lidar.translation ||
         how.T_given_lidar.rotation != before.T_given_lidar.rotation;
}

void print_correction(const OpenedInput& opened, const input::Calibration& calibration) {
  const auto say = [](const std::string& text) {
    std::fprintf(stderr, "onboard: input: %s\n", text.c_str());
  };
  if (opened.how.turns_over) say("points and poses are upside down and were turned over");
  if (opened.how.finds_mount) {
    say("--extrinsic " + input::extrinsic_text(opened.correction().T_base_lidar) + " is used" +
        (calibration.shows_rotation() ? "" : "; the motion does not show yaw and pitch") +
        (calibration.shows_lever_arm() ? "" : "; the motion does not show the lever arm"));
  }
  if (opened.how.finds_time_offset) {
    say(input::text("--time-offset %.3f is used", opened.how.time_offset_s) +
        (calibration.shows_delay() ? "" : "; the motion does not show a delay"));
  }
}

/// What the reader guessed of the LiDAR's place comes before what follows from a wrong guess.
std::string reason_of_reader(const datasets::Dataset& dataset, const input::Finding& refusal) {
  std::string reason;
  if (refusal.check != "motion" && refusal.check != "axes") return reason;
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
  if (options.input.topic.find(',') != std::string::npos) {
    throw std::runtime_error("--extrinsic auto and --time-offset auto are for one LiDAR");
  }
  constexpr int kMostRounds = 3;  // registration starts from the poses as corrected so far
  input::Calibration calibration;
  for (int round = 0; round < kMostRounds; ++round) {
    const input::Plausibility found = input::examine(*opened.dataset, options.scans);
    if (round == 0) calibration = found.calibration;
    if (!correct(found, opened)) break;
    opened.dataset = datasets::open_dataset(options.dataset, opened.how);
  }
  print_correction(opened, calibration);
  return opened;
}

CheckedInput check_input(const OnboardOptions& options, const OpenedInput& opened) {
  input::Plausibility found = input::examine(*opened.dataset, options.scans, opened.correction());
  std::vector<input::Finding>& findings = found.findings;
  const input::Finding* refusal = nullptr;
  for (const input::Finding& finding : findings) {
    if (finding.severity == input::Severity::kFine) continue;
    const bool refuses = finding.severity == input::Severity::kWrong && !options.force;
    if (refuses && refusal == nullptr) {
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
  return {std::move(findings), found.sensor, std::move(found.steps.breaks)};
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
