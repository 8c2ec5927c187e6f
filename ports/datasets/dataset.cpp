#include "ports/datasets/dataset.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "ports/datasets/deskew.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/mounting.hpp"
#include "ports/datasets/own_odometry.hpp"
#include "ports/datasets/readers.hpp"
#include "ports/datasets/scan_faults.hpp"

namespace unimapper::datasets {

namespace {

std::unique_ptr<Dataset> open_with_reader(const std::filesystem::path& path,
                                          const OpenOptions& options) {
  if (options.format == "auto") return recognise(path).open(path, options);
  const Reader* reader = find_reader(options.format);
  if (reader == nullptr) {
    throw DatasetError("--format: unknown format '" + options.format + "'; there are " +
                       format_names());
  }
  std::error_code error;
  if (!std::filesystem::exists(path, error)) fail(path, "no such file or directory");
  return reader->open(path, options);
}

/// Scans of one LiDAR with poses from these scans alone, which need no correction.
std::unique_ptr<Dataset> open_without_poses(std::unique_ptr<Dataset> dataset,
                                            const OpenOptions& options) {
  if (options.refuses_unknown_mounting) {
    throw DatasetError("own odometry takes the scans of one LiDAR: choose it with --topic");
  }
  if (options.time_offset_s != 0.0 || options.finds_time_offset || options.finds_mount) {
    throw DatasetError(
        "--time-offset and --extrinsic auto correct recorded poses; there are none, or --odometry "
        "own leaves them out");
  }
  OwnOdometryOptions own;
  if (!options.T_base_lidar.empty()) own.T_base_lidar = options.T_base_lidar.front();
  own.most_scans = options.most_scans;
  own.deskew = options.deskew;
  own.progress = options.odometry_progress;
  return with_own_odometry(std::move(dataset), own);
}

/// One LiDAR's scans.
std::unique_ptr<Dataset> open_lidar(const std::filesystem::path& path, const OpenOptions& options) {
  if (options.own_odometry &&
      (!options.poses.empty() || !options.odometry_topic.empty() || !options.frame.empty())) {
    throw DatasetError("own odometry takes no poses: leave out --poses, --odometry-topic, --frame");
  }
  std::unique_ptr<Dataset> dataset = with_counted_faults(open_with_reader(path, options));
  if (options.own_odometry || !dataset->has_poses()) {
    return deskewed(open_without_poses(std::move(dataset), options), options.deskew);
  }
  if (!options.imu_topic.empty() && options.imu_topic != "off") {
    throw DatasetError(
        "--imu-topic: recorded poses take no gyroscope; the own odometry does (--odometry own)");
  }
  if (options.time_offset_s != 0.0) {
    dataset = retimed(std::move(dataset), options.time_offset_s);
  }
  if (!options.T_base_lidar.empty()) {
    dataset = mounted(std::move(dataset), options.T_base_lidar.front());
  }
  if (!options.T_given_lidar.rotation.isIdentity() || !options.T_given_lidar.translation.isZero()) {
    dataset = mounted(std::move(dataset), options.T_given_lidar);
  }
  if (options.turns_over) dataset = turned_over(std::move(dataset));
  return deskewed(std::move(dataset), options.deskew);
}

/// The names between the commas, blanks around them left out.
std::vector<std::string> names_of(const std::string& list) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    const std::string name = list.substr(begin, end - begin);
    const std::size_t first = name.find_first_not_of(' ');
    names.push_back(first == std::string::npos
                        ? std::string()
                        : name.substr(first, name.find_last_not_of(' ') - first + 1));
    begin = end + 1;
  }
  return names;
}

/// LiDARs that are put together at a wrong place look like dynamic objects.
void require_mountings(std::size_t lidars, const OpenOptions& options) {
  const std::size_t given = options.T_base_lidar.size();
  if (given == lidars) return;
  const std::string each = "--extrinsic x,y,z,roll,pitch,yaw once for each of the " +
                           std::to_string(lidars) + " LiDARs, in the order of --topic";
  if (given > 0) {
    throw DatasetError(std::to_string(given) + (given == 1 ? " mounting is" : " mountings are") +
                       " given: give " + each);
  }
  if (lidars > 1 && !options.poses.empty()) {
    throw DatasetError("--poses are those of one LiDAR or of the robot: give " + each);
  }
}

std::unique_ptr<Dataset> open_lidars(const std::filesystem::path& path, const OpenOptions& options,
                                     const std::vector<std::string>& topics) {
  if (!options.T_base_lidar.empty() || topics.size() > 1) require_mountings(topics.size(), options);
  if (topics.size() > 1 && options.finds_mount) {
    throw DatasetError("--extrinsic auto finds the mount of one LiDAR: choose it with --topic");
  }
  std::vector<std::unique_ptr<Dataset>> lidars;
  for (std::size_t i = 0; i < topics.size(); ++i) {
    OpenOptions one = options;
    one.topic = topics[i];
    one.refuses_unknown_mounting = topics.size() > 1;
    if (!options.T_base_lidar.empty()) one.T_base_lidar = {options.T_base_lidar[i]};
    lidars.push_back(open_lidar(path, one));
  }
  return several_lidars(std::move(lidars));
}

}  // namespace

std::unique_ptr<Dataset> open_dataset(const std::filesystem::path& path,
                                      const OpenOptions& options) {
  const std::vector<std::string> topics = names_of(options.topic);
  try {
    return open_lidars(path, options, topics);
  } catch (const SeveralLidarsError& several) {
    if (topics.size() > 1 || !options.T_base_lidar.empty() || !options.poses.empty()) throw;
    try {
      return open_lidars(path, options, several.topics());
    } catch (const DatasetError& error) {
      throw DatasetError(std::string(several.what()) + "; as one they fail: " + error.what());
    }
  }
}

}  // namespace unimapper::datasets
