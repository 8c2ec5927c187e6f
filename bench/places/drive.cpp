#include "bench/places/drive.hpp"

#include <time.h>

#include <stdexcept>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/lcm/received_log.hpp"
#include "src/merge/in_arena.hpp"
#include "src/merge/parallel.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::bench {
namespace {

constexpr const char* kStdFile = "std.places";

PlaceKeyframe describe(KeyframeRecord& record, PlaceDescriber& describer) {
  PlaceKeyframe keyframe;
  keyframe.sequence = record.sequence;
  keyframe.scan = record.scans[record.reference_scan].scan_index;
  keyframe.T_odometry_keyframe = record.T_odometry_keyframe;
  keyframe.scans = std::move(record.scans);
  const double start = thread_milliseconds();
  const PlaceView place = describer.describe(record.static_cells);
  keyframe.describe_ms = thread_milliseconds() - start;
  keyframe.keypoints.assign(place.keypoints.begin(), place.keypoints.end());
  keyframe.planes.assign(place.planes.begin(), place.planes.end());
  return keyframe;
}

void set_true_pose(const std::vector<Pose>& truth, PlaceKeyframe& keyframe) {
  if (keyframe.scan >= truth.size()) throw std::runtime_error("the truth is of another run");
  for (const KeyframeScan& scan : keyframe.scans) {
    if (scan.scan_index != keyframe.scan) continue;
    keyframe.T_world_keyframe =
        truth[keyframe.scan] * scan.T_odometry_sensor.inverse() * keyframe.T_odometry_keyframe;
  }
}

}  // namespace

double thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

Drive read_drive(const std::filesystem::path& run) {
  lcm_port::ReceivedLog received = lcm_port::read_event_log(run / "keyframes.lcmlog");
  if (received.sessions.size() != 1) {
    throw std::runtime_error(run.string() + ": does not hold exactly one session");
  }
  const std::filesystem::path file = run / "gt_poses.txt";
  const auto truth = datasets::parse_trajectory(datasets::read_file(file), file).poses;
  const PipelineConfig config;
  merge::InArena<PlaceDescriber> describer(config.descriptor, config.descriptor_input());
  Drive drive;
  const std::string name = run.filename().string();
  drive.sensor = name.substr(0, name.rfind('-'));
  drive.route = name.substr(name.rfind('-') + 1);
  for (KeyframeRecord& record : received.sessions.front().keyframes) {
    drive.keyframes.push_back(describe(record, *describer));
    set_true_pose(truth, drive.keyframes.back());
  }
  if (!std::filesystem::exists(run / kStdFile)) return drive;
  drive.std_places = read_std_file(run / kStdFile);
  if (drive.std_places.size() == drive.keyframes.size()) return drive;
  throw std::runtime_error((run / kStdFile).string() + ": belongs to another run");
}

void describe_std(const std::filesystem::path& run, const std::filesystem::path& recording) {
  const Drive drive = read_drive(run);
  const auto dataset = datasets::open_dataset(recording);
  std::vector<StdPlace> places(drive.keyframes.size());
  merge::parallel_for(places.size(), 0, [&](std::size_t i) {
    StdCloud cloud;
    datasets::Scan scan;
    for (const KeyframeScan& of_keyframe : drive.keyframes[i].scans) {
      dataset->read_scan(of_keyframe.scan_index, scan);
      add_scan(scan.view(), of_keyframe.T_odometry_sensor, cloud);
    }
    places[i] = describe_cloud(cloud);
  });
  write_std_file(run / kStdFile, places);
}

}  // namespace unimapper::bench
