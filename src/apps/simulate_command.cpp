// `unimapper simulate`: the command line of src/simulator.
#include <CLI/CLI.hpp>
#include <charconv>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "src/apps/commands.hpp"
#include "src/apps/onboard/progress.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/simulate/bag_output.hpp"
#include "src/apps/suggestion.hpp"
#include "src/input/extrinsic.hpp"
#include "src/simulator/simulate.hpp"

namespace unimapper::apps {
namespace {

struct SimulateOptions {
  simulator::SimulationConfig config;
  std::string sensor = "os2-128";
  std::string route = "A";
  std::string drift = "lio";
  std::string odometry_start = "level";
  std::string points = "sensor";
  std::string attitude_noise;
  std::string sway;
  std::uint32_t day = 0;
  std::string out;
  bool replaces = false;
  std::vector<std::string> bags;
  std::string extrinsic;
  BagTopics topics;
};

std::vector<std::string> known_sensors() {
  std::vector<std::string> names;
  for (const SensorModel& model : sensor_models()) {
    if (model.kind != SensorKind::kGeneric) names.emplace_back(model.name);
  }
  return names;
}

/// Reads a whole text as a number.
double require_number(const std::string& text, const std::string& option) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stopped != end) {
    throw std::runtime_error(option + ": '" + text + "' is not a number");
  }
  return value;
}

void read_attitude(SimulateOptions& options) {
  const auto start = simulator::parse_odometry_start(options.odometry_start);
  if (!start) {
    throw std::runtime_error("unknown odometry start '" + options.odometry_start +
                             "'; there are: level, identity");
  }
  const auto points = simulator::parse_point_frame(options.points);
  if (!points) {
    throw std::runtime_error("unknown frame of points '" + options.points +
                             "'; there are: sensor, body");
  }
  options.config.odometry_start = *start;
  options.config.points = *points;
  if (!options.attitude_noise.empty()) {
    const std::string& text = options.attitude_noise;
    const std::size_t at = text.find('@');
    simulator::AttitudeNoise& noise = options.config.attitude_noise;
    noise.sigma_deg = require_number(text.substr(0, at), "--attitude-noise");
    if (at != std::string::npos) {
      noise.correlated_s = require_number(text.substr(at + 1), "--attitude-noise");
    }
  }
  if (!options.sway.empty()) {
    const std::size_t at = options.sway.find('@');
    if (at == std::string::npos) {
      throw std::runtime_error("--sway: '" + options.sway + "' is not of the form DEG@HZ");
    }
    options.config.sway = {require_number(options.sway.substr(0, at), "--sway"),
                           require_number(options.sway.substr(at + 1), "--sway")};
  }
}

void run(SimulateOptions& options, bool has_day) {
  const SensorModel* sensor = find_sensor(options.sensor);
  if (sensor == nullptr) {
    throw std::runtime_error("unknown sensor '" + options.sensor +
                             "'; there are: " + joined(known_sensors()) +
                             did_you_mean(options.sensor, known_sensors()));
  }
  const auto drift = simulator::parse_drift(options.drift);
  if (!drift) {
    throw std::runtime_error("unknown drift '" + options.drift +
                             "'; there are: none, lio, icp, bad");
  }
  if (options.route.size() != 1) {
    throw std::runtime_error("unknown route '" + options.route + "'; there are: A, B, C");
  }
  options.config.sensor = sensor->kind;
  options.config.drift = *drift;
  options.config.route = options.route[0];
  read_attitude(options);
  if (has_day) options.config.day = options.day;
  std::vector<bags::Container> containers;
  for (const std::string& name : options.bags) {
    containers.push_back(bags::parse_container(name).value());
  }
  Pose T_base_lidar;
  if (!options.extrinsic.empty())
    T_base_lidar = input::parse_extrinsic(options.extrinsic, "--extrinsic");

  check_output_folder(options.out, Output::kRecording, options.replaces);
  remove_earlier_output(options.out, Output::kRecording);
  Progress progress("simulate", options.config.scans);
  std::optional<BagOutput> bags;  // made once the folder is there
  simulator::DriveObserver observer;
  if (!containers.empty()) {
    observer = [&](const simulator::DriveStep& step) {
      if (!bags) bags.emplace(containers, options.out, T_base_lidar, options.topics);
      bags->write(step);
    };
  }
  simulator::simulate(
      options.config, options.out,
      [&](std::uint32_t done, std::uint32_t) { progress.update(done, options.sensor); }, observer);
  if (bags) bags->close();
}

void add_bags(CLI::App& command, SimulateOptions& options) {
  CLI::Option* bag =
      command
          .add_option("--bag", options.bags,
                      "Write the messages of the robot's drivers too, motion not compensated: mcap "
                      "(OUT/drive.mcap), rosbag1 (OUT/drive.bag) or rosbag2 (OUT/drive/); several "
                      "with commas")
          ->delimiter(',')
          ->check(CLI::IsMember({"mcap", "rosbag1", "rosbag2"}));
  command
      .add_option("--extrinsic", options.extrinsic,
                  "x,y,z,roll,pitch,yaw of the LiDAR on the bags' base_link, metres and degrees")
      ->needs(bag);
  command
      .add_flag(
          "--imu", options.topics.has_imu,
          "Write angular velocity and acceleration of base_link into the bags, too, with biases "
          "and noise")
      ->needs(bag);
  command
      .add_flag("!--no-odometry", options.topics.has_odometry,
                "Leave /odom and /tf out of the bags")
      ->needs(bag);
}

void add_sampling(CLI::App& command, simulator::Sampling& sampling) {
  command.add_option("--columns", sampling.columns,
                     "Columns per turn of a spinning LiDAR, 256 to 2048 (default: the sensor's)");
  command.add_option("--rings", sampling.rings,
                     "Rings of a spinning LiDAR, 8 to 128, evenly spaced in its field of view "
                     "(default: the sensor's)");
  command.add_flag("--uneven-rings", sampling.uneven_rings,
                   "Half of the rings in a quarter of the field of view around the horizon");
}

void add_attitude(CLI::App& command, SimulateOptions& options) {
  simulator::SimulationConfig& config = options.config;
  command.add_option("--mount-roll", config.mount.roll_deg,
                     "Roll of the sensor on the body, degrees");
  command.add_option("--mount-pitch", config.mount.pitch_deg,
                     "Pitch of the sensor on the body, degrees, down positive");
  command
      .add_option("--odometry-start", options.odometry_start,
                  "level: z against gravity; identity: the first scan's frame as mounted")
      ->capture_default_str();
  command
      .add_option("--points", options.points,
                  "Frame of points and poses: sensor, or body (rotated by the mount)")
      ->capture_default_str();
  command.add_option("--attitude-noise", options.attitude_noise,
                     "DEG[@SECONDS]: noise of roll and pitch in the odometry, independent per scan "
                     "or correlated over SECONDS");
  command.add_option("--sway", options.sway,
                     "DEG@HZ: the body rolls and pitches, and the odometry follows");
  command.add_flag("--distortion", config.is_distorted,
                   "Points are not motion-compensated within the sweep");
}

}  // namespace

void register_simulate(CLI::App& app) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* command =
      app.add_subcommand("simulate", "Simulate a recording: scans, labels, odometry, truth");
  simulator::SimulationConfig& config = options->config;
  command
      ->add_option("--scene", config.scene,
                   "town: streets, seen from a car; campus: pedestrians all around a small robot; "
                   "deck: parked cars and walkers under a low ceiling; square: dense crowd; "
                   "convoy: the town, stop-and-go; street: walkers beside surfaces first seen with "
                   "them, parked trucks, thin poles; tunnel; hall; and places of which there are "
                   "two that look alike, A and B in one, C in the other: bore, fixtures, decks, "
                   "streets, corridor, courtyard, quad, orchard")
      ->capture_default_str();
  command->add_option("--sensor", options->sensor, joined(known_sensors()))->capture_default_str();
  command->add_option("--route", options->route, "A, B or C: tours that share their first round")
      ->capture_default_str();
  command->add_option("--scans", config.scans, "Number of scans, ten per second")
      ->capture_default_str();
  command->add_option("--seed", config.seed, "The scene; another seed is another town or campus")
      ->capture_default_str();
  CLI::Option* day =
      command->add_option("--day", options->day,
                          "Day of the recording (default: route A 0, B 1, C 2); parked cars and "
                          "actors differ");
  command->add_option("--drift", options->drift, "Odometry: none, lio, icp or bad")
      ->capture_default_str();
  add_sampling(*command, config.sampling);
  add_attitude(*command, *options);
  for (const char* name :
       {"--columns", "--rings", "--uneven-rings", "--mount-roll", "--mount-pitch",
        "--odometry-start", "--points", "--attitude-noise", "--sway", "--distortion"}) {
    command->get_option(name)->group("Mode, mounting and attitude");
  }
  add_bags(*command, *options);
  command->add_option("--thin", config.thin, "Keep every n-th column (spinning) or shot")
      ->capture_default_str();
  command->add_option("--threads", config.threads, "0: all cores")->capture_default_str();
  command->add_option("--out", options->out, "Folder to write")->required();
  command->add_flag("--replace", options->replaces,
                    "Overwrite an earlier simulated recording in that folder");
  command->footer(
      "Example:\n  unimapper simulate --scene town --sensor os2-128 --route A --scans 300 --seed 7 "
      "--out town_a\n"
      "  unimapper simulate --scene campus --sensor livox-avia --scans 600 --out campus_a");
  command->callback([options, day] { run(*options, day->count() > 0); });
}

}  // namespace unimapper::apps
