// Localisation of a run in the map of a store, answer by answer.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "ports/datasets/writers.hpp"
#include "src/apps/localise/localise_options.hpp"
#include "src/apps/map/stored_map.hpp"
#include "src/apps/map_pose_text.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/print.hpp"
#include "src/apps/replacement.hpp"
#include "src/apps/upper_triangle.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/localisation.hpp"

namespace unimapper::apps {
namespace {

using LocaliseJson = nlohmann::ordered_json;

/// Everything said about a run.
struct Answers {
  std::int64_t epoch = 0;
  std::vector<std::string> sessions;  ///< whose keyframe it is
  std::vector<std::uint32_t> sequences;
  std::vector<std::int64_t> stamps_ns;  ///< of the reference scans
  std::vector<Pose> T_map_sensor;       ///< at the stamps of the reference scans
  std::vector<merge::MapPose> poses;
  std::uint32_t times_lost = 0;
  std::vector<double> durations_ms;
};

/// In the epoch that was asked for, or that of earlier answers: a base may merge meanwhile.
merge::Localiser localiser_of(const LocaliseOptions& options, Answers& answers) {
  StoredMap map =
      read_stored_map(options.store, answers.epoch == 0 ? options.epoch : answers.epoch);
  if (options.threads) map.config.threads = *options.threads;
  answers.epoch = map.epoch;
  return {std::move(map.sessions), map.posed, map.config};
}

/// The sessions to localise: the one with the name, or all, of which a run that was cut has
/// several.
std::vector<SessionData> read_sessions(const LocaliseOptions& options) {
  MergeOptions merge_options;
  merge_options.runs = {options.run};
  StoredContents contents(merge::MergeConfig().kept_bytes());
  std::vector<InputSession> inputs =
      gather_sessions(merge_options, contents, std::filesystem::temp_directory_path());
  std::vector<SessionData> sessions;
  std::string names;
  for (InputSession& input : inputs) {
    names += (names.empty() ? "" : ", ") + input.data.info.name;
    if (options.session.empty() || input.data.info.name == options.session) {
      sessions.push_back(std::move(input.data));
    }
  }
  if (sessions.empty()) {
    throw std::runtime_error(options.run.string() + ": no session " + options.session +
                             "; it holds " + names);
  }
  return sessions;
}

/// Standard deviation of the position along its three axes together, metres.
double position_sigma_m(const merge::MapPose& at) {
  return std::sqrt(at.covariance.topLeftCorner<3, 3>().trace());
}

double rotation_sigma_deg(const merge::MapPose& at) {
  return kDegreesPerRadian * std::sqrt(at.covariance.bottomRightCorner<3, 3>().trace());
}

bool is_localised(const merge::MapPose& at) {
  return at.state == merge::LocalisationState::kLocalised;
}

LocaliseJson describe(const Answers& answers, std::size_t i) {
  const merge::MapPose& at = answers.poses[i];
  LocaliseJson json = {{"session", answers.sessions[i]},
                       {"keyframe", answers.sequences[i]},
                       {"stamp_ns", answers.stamps_ns[i]},
                       {"path_m", at.path_m},
                       {"state", merge::state_name(at.state)}};
  if (!at.reason.empty()) json["reason"] = at.reason;
  if (!is_localised(at)) return json;
  json["T_map_keyframe"] = pose_numbers(at.T_map_keyframe);
  json["T_map_odometry"] = pose_numbers(at.T_map_odometry);
  json["covariance"] = upper_triangle(at.covariance);
  json["sigma_m"] = position_sigma_m(at);
  json["sigma_deg"] = rotation_sigma_deg(at);
  json["loops"] = at.loops;
  json["since_loop_m"] = at.since_loop_m;
  return json;
}

/// Metres driven until the first position; negative if there was none.
double first_localised_m(const Answers& answers) {
  const auto first = std::find_if(answers.poses.begin(), answers.poses.end(), is_localised);
  return first == answers.poses.end() ? -1.0 : first->path_m;
}

void print_json(const Answers& answers) {
  LocaliseJson json = {{"epoch", answers.epoch}};
  const double first = first_localised_m(answers);
  json["first_localised_m"] = first < 0.0 ? LocaliseJson(nullptr) : LocaliseJson(first);
  json["times_lost"] = answers.times_lost;
  json["keyframes"] = LocaliseJson::array();
  for (std::size_t i = 0; i < answers.poses.size(); ++i) {
    json["keyframes"].push_back(describe(answers, i));
  }
  std::cout << json.dump(2) << '\n';
}

void print_text(const Answers& answers) {
  std::size_t localised = 0;
  for (std::size_t i = 0; i < answers.poses.size(); ++i) {
    const merge::MapPose& at = answers.poses[i];
    if (answers.sessions.front() != answers.sessions.back() &&
        (i == 0 || answers.sessions[i] != answers.sessions[i - 1])) {
      print_to(stdout, "session {}\n", answers.sessions[i]);
    }
    if (is_localised(at)) {
      ++localised;
      const Eigen::Vector3d& t = at.T_map_keyframe.translation;
      print_to(
          stdout,
          "keyframe {}  {:8.1f} m  localised  {:.2f} {:.2f} {:.2f}  +- {:.2f} m {:.2f} deg  {} "
          "loops\n",
          answers.sequences[i], at.path_m, t.x(), t.y(), t.z(), position_sigma_m(at),
          rotation_sigma_deg(at), at.loops);
    } else {
      print_to(stdout, "keyframe {}  {:8.1f} m  {}: {}\n", answers.sequences[i], at.path_m,
               merge::state_name(at.state), at.reason);
    }
  }
  print_to(stdout, "{} of {} keyframes localised in epoch {}", localised, answers.poses.size(),
           answers.epoch);
  const double first = first_localised_m(answers);
  if (first >= 0.0) print_to(stdout, ", first after {:.1f} m", first);
  print_to(stdout, "\n");
}

void write_poses(const LocaliseOptions& options, const Answers& answers) {
  if (options.out.empty()) return;
  if (!std::is_sorted(answers.stamps_ns.begin(), answers.stamps_ns.end())) {
    throw std::runtime_error("--out: the sessions of " + options.run.string() +
                             " overlap in time, so they are no one trajectory; choose one with "
                             "--session");
  }
  FileReplacement file(options.out);
  std::vector<std::int64_t> stamps_ns;
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < answers.poses.size(); ++i) {
    if (!is_localised(answers.poses[i])) continue;
    stamps_ns.push_back(answers.stamps_ns[i]);
    poses.push_back(answers.T_map_sensor[i]);
  }
  datasets::write_tum(file.path(), stamps_ns, poses);
  file.publish();
}

void report_durations(const std::vector<double>& durations_ms) {
  if (durations_ms.empty()) return;
  const double sum = std::accumulate(durations_ms.begin(), durations_ms.end(), 0.0);
  print_to(stderr, "unimapper: {} keyframes, {:.1f} ms each, {:.1f} ms the longest\n",
           durations_ms.size(), sum / static_cast<double>(durations_ms.size()),
           *std::max_element(durations_ms.begin(), durations_ms.end()));
}

/// Adds what is said about one session; its way goes on where that of those before ended.
void localise(const SessionData& session, merge::Localiser& localiser, Answers& answers) {
  const double before_m = answers.poses.empty() ? 0.0 : answers.poses.back().path_m;
  std::uint32_t times_lost = 0;
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    KeyframeRecord keyframe = *whole_keyframe(session, k);
    answers.sessions.push_back(session.info.name);
    answers.sequences.push_back(keyframe.sequence);
    answers.stamps_ns.push_back(keyframe.scans[keyframe.reference_scan].stamp_ns);
    const Pose T_keyframe_sensor = merge::reference_sensor_pose(keyframe);
    const auto start = std::chrono::steady_clock::now();
    merge::MapPose& at = answers.poses.emplace_back(localiser.add(std::move(keyframe)));
    const std::chrono::duration<double, std::milli> of_keyframe =
        std::chrono::steady_clock::now() - start;
    answers.durations_ms.push_back(of_keyframe.count());
    answers.T_map_sensor.push_back(at.T_map_keyframe * T_keyframe_sensor);
    times_lost = at.times_lost;
    at.path_m += before_m;
  }
  answers.times_lost += times_lost;
}

}  // namespace

void run_localise(const LocaliseOptions& options) {
  if (!options.out.empty()) check_output_file(options.out, options.replaces);
  Answers answers;
  merge::Localiser localiser = localiser_of(options, answers);
  const std::vector<SessionData> sessions = read_sessions(options);
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    // No answer rests on keyframes beyond a break of the odometry.
    if (s > 0) localiser = localiser_of(options, answers);
    localise(sessions[s], localiser, answers);
  }
  write_poses(options, answers);
  options.json ? print_json(answers) : print_text(answers);
  report_durations(answers.durations_ms);
}

}  // namespace unimapper::apps
