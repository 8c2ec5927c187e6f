#include "src/apps/input_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "ports/datasets/readers.hpp"
#include "src/apps/suggestion.hpp"
#include "src/input/extrinsic.hpp"
#include "src/input/sensor_sheets.hpp"

namespace unimapper::apps {
namespace {

std::string describe_formats() {
  std::string text = "How the recording is laid out; auto: as it looks.";
  for (const datasets::Reader& reader : datasets::readers()) {
    text += "\n" + std::string(reader.name) + ": " + std::string(reader.description);
  }
  return text;
}

std::vector<std::string> formats() {
  std::vector<std::string> names = {"auto"};
  for (const datasets::Reader& reader : datasets::readers()) names.emplace_back(reader.name);
  return names;
}

/// An error message where there is no such format.
std::string check_format(const std::string& name) {
  const std::vector<std::string> known = formats();
  if (std::find(known.begin(), known.end(), name) != known.end()) return {};
  return "unknown format '" + name + "'; there are " + joined(known) + did_you_mean(name, known);
}

}  // namespace

void add_open_options(CLI::App& command, datasets::OpenOptions& options) {
  command.add_option("--format", options.format, describe_formats())
      ->capture_default_str()
      ->check(CLI::Validator(&check_format, ""))
      ->group("Input");
  command
      .add_option("--sensor", options.sensor,
                  "LiDAR; default: as the recording says or its points look. One of " +
                      joined(input::sensor_names()))
      ->group("Input");
  command
      .add_option("--sequence", options.sequence,
                  "Of a root with several: KITTI's 00, a raw drive's 0005, nuScenes' scene-0061")
      ->group("Input");
  command
      .add_option("--point-fields", options.point_fields,
                  "Fields of *.bin records, e.g. \"x y z intensity ring\" or \"x y z "
                  "intensity:u1 ring:u2 t:u4\"; default: found from sizes and content")
      ->group("Input");
  command
      .add_option("--poses", options.poses,
                  "Pose file, where it is not beside the scans: TUM, KITTI or 4x4 matrices")
      ->group("Input");
  command
      .add_option_function<std::string>(
          "--odometry",
          [&options](const std::string& source) { options.own_odometry = source == "own"; },
          "Whose poses: auto (those of the recording; where it has none, the own odometry, which "
          "takes them from the scans) or own")
      ->check(CLI::IsMember({"auto", "own"}))
      ->group("Input");
  command
      .add_option("--topic", options.topic,
                  "Scans in a bag, where there are several such topics; A,B: two LiDARs of one "
                  "robot as one; A@FRAME: one of several LiDARs on a topic")
      ->group("Input");
  command
      .add_option("--odometry-topic", options.odometry_topic,
                  "Poses in a bag, where there are several such topics; /tf: the transforms")
      ->group("Input");
  command
      .add_option(
          "--imu-topic", options.imu_topic,
          "Gyroscope in a bag (sensor_msgs/Imu), which the own odometry takes: default that "
          "of the LiDAR, or the only one that is fixed to it; off: none")
      ->group("Input");
  command
      .add_option("--frame", options.frame,
                  "Frame in which a bag's transforms give poses, e.g. odom; default: found")
      ->group("Input");
  command
      .add_option_function<std::vector<std::string>>(
          "--extrinsic",
          [&options](const std::vector<std::string>& texts) {
            options.T_base_lidar.clear();
            options.finds_mount = texts == std::vector<std::string>{"auto"};
            if (options.finds_mount) return;
            for (const std::string& text : texts) {
              options.T_base_lidar.push_back(input::parse_extrinsic(text, "--extrinsic"));
            }
          },
          "x,y,z,roll,pitch,yaw of the LiDAR on what the poses are of, metres and degrees, turned "
          "about the fixed axes x, y, z in this order; default: that of --sensor-file, a bag's "
          "transforms, or none. Of several LiDARs once for each, in the order of --topic. auto: "
          "that, corrected by what the scans show of it, where they are sure")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group("Input");
  command
      .add_option_function<std::string>(
          "--time-offset",
          [&options](const std::string& text) {
            options.finds_time_offset = text == "auto";
            if (options.finds_time_offset) return;
            if (!CLI::detail::lexical_cast(text, options.time_offset_s) ||
                !(std::fabs(options.time_offset_s) <= 3600.0)) {
              throw CLI::ValidationError(
                  "--time-offset", "'" + text + "' is neither auto nor seconds, an hour at most");
            }
          },
          "Seconds that are added to the stamps of the poses: negative where they are late. auto: "
          "as the scans show, where they are sure")
      ->group("Input");
  const std::map<std::string, datasets::Deskew> modes = {{"auto", datasets::Deskew::kAuto},
                                                         {"on", datasets::Deskew::kOn},
                                                         {"off", datasets::Deskew::kOff}};
  command
      .add_option("--deskew", options.deskew,
                  "Compensate the motion within sweeps, where points have a time: auto (if that "
                  "makes scans sharper), on or off")
      ->transform(CLI::CheckedTransformer(modes).description(""))
      ->group("Input");
}

void add_sensor_file_option(CLI::App& command, std::filesystem::path& file) {
  command
      .add_option("--sensor-file", file,
                  "Data sheet of a LiDAR that --sensor does not know, as JSON, and where it is "
                  "mounted (extrinsic); the known ones are in share/unimapper/sensors.json")
      ->group("Input");
}

}  // namespace unimapper::apps
