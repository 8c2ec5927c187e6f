#include "bench/places/drive.hpp"

#include <stdexcept>

#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/lcm/received_log.hpp"

namespace unimapper::bench {
namespace {

PlaceKeyframe keyframe_of(KeyframeRecord&& record) {
  PlaceKeyframe keyframe;
  keyframe.sequence = record.sequence;
  keyframe.scan = record.scans[record.reference_scan].scan_index;
  keyframe.T_odometry_keyframe = record.T_odometry_keyframe;
  keyframe.T_world_keyframe = record.T_odometry_keyframe;
  keyframe.static_cells = std::move(record.static_cells);
  keyframe.dynamic_cells = std::move(record.dynamic_cells);
  keyframe.scans = std::move(record.scans);
  return keyframe;
}

void set_true_poses(Drive& drive, const std::filesystem::path& file) {
  const auto truth = datasets::parse_trajectory(datasets::read_file(file), file).poses;
  for (PlaceKeyframe& keyframe : drive.keyframes) {
    if (keyframe.scan >= truth.size()) {
      throw std::runtime_error(file.string() + ": belongs to another run");
    }
    for (const KeyframeScan& scan : keyframe.scans) {
      if (scan.scan_index != keyframe.scan) continue;
      keyframe.T_world_keyframe =
          truth[keyframe.scan] * scan.T_odometry_sensor.inverse() * keyframe.T_odometry_keyframe;
    }
  }
}

}  // namespace

Drive read_drive_without_truth(const std::filesystem::path& run) {
  const std::filesystem::path log = run / "keyframes.lcmlog";
  lcm_port::ReceivedLog received = lcm_port::read_event_log(log);
  if (received.sessions.size() != 1) {
    throw std::runtime_error(log.string() + ": does not hold exactly one session");
  }
  Drive drive;
  drive.sensor = received.sessions.front().info.sensor;
  for (KeyframeRecord& record : received.sessions.front().keyframes) {
    drive.keyframes.push_back(keyframe_of(std::move(record)));
  }
  return drive;
}

Drive read_drive(const std::filesystem::path& run) {
  Drive drive = read_drive_without_truth(run);
  set_true_poses(drive, run / "gt_poses.txt");
  return drive;
}

std::vector<evaluate::TrueKeyframe> true_keyframes(const Drive& drive) {
  std::vector<evaluate::TrueKeyframe> result;
  for (const PlaceKeyframe& keyframe : drive.keyframes) {
    result.push_back({keyframe.sequence, keyframe.scan, keyframe.T_world_keyframe});
  }
  return result;
}

void release_cells(Drive& drive) {
  for (PlaceKeyframe& keyframe : drive.keyframes) {
    keyframe.static_cells = {};
    keyframe.dynamic_cells = {};
  }
}

}  // namespace unimapper::bench
