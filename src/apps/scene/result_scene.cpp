#include "src/apps/scene/result_scene.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <unordered_set>

#include "ports/lcm/received_log.hpp"
#include "src/core/voxel_key.hpp"
#include "src/merge/export/loops_csv.hpp"

namespace unimapper::apps {
namespace {

constexpr bags::Rgba kRemovedColor{230, 60, 40};
constexpr bags::Rgba kAppearedColor{0, 200, 0};
constexpr bags::Rgba kGoneColor{220, 0, 0};
constexpr bags::Rgba kLoopColor{255, 200, 0};

SessionData read_run(const std::filesystem::path& run) {
  const std::filesystem::path log = run / "keyframes.lcmlog";
  if (!std::filesystem::exists(log)) {
    throw std::runtime_error(run.string() +
                             ": holds no keyframes.lcmlog; is it a folder that "
                             "`unimapper onboard --out` wrote? A map is written "
                             "by `unimapper merge --mcap`");
  }
  lcm_port::ReceivedLog received = lcm_port::read_event_log(log);
  if (received.sessions.size() != 1) {
    throw std::runtime_error(log.string() + ": holds " + std::to_string(received.sessions.size()) +
                             " sessions; only a run of one is taken");
  }
  return std::move(received.sessions.front());
}

/// A session alone, in its own odometry frame.
merge::MergedSession alone(const SessionData& session) {
  merge::MergedSession merged;
  merged.status = merge::SessionStatus::kCentral;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    merged.T_map_keyframe.push_back(keyframe.T_odometry_keyframe);
  }
  return merged;
}

/// The removed cells of a session, the first of each voxel.
std::vector<Eigen::Vector3f> removed_points(const SessionData& session) {
  constexpr float kVoxel_m = 0.2F;
  std::vector<Eigen::Vector3f> points;
  std::unordered_set<VoxelKey> taken;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    for (const FineCell& cell : keyframe.dynamic_cells) {
      const Eigen::Vector3f p =
          (keyframe.T_odometry_keyframe * cell.position.cast<double>()).cast<float>();
      const VoxelIndex index = voxel_index(p, 1.0F / kVoxel_m);
      if (is_representable(index) && taken.insert(pack(index)).second) points.push_back(p);
    }
  }
  return points;
}

/// Position of the sensor at a keyframe's reference scan.
std::optional<Eigen::Vector3d> sensor_position(const SessionData& session, std::uint32_t sequence) {
  const auto found = std::find_if(
      session.keyframes.begin(), session.keyframes.end(),
      [sequence](const KeyframeRecord& keyframe) { return keyframe.sequence == sequence; });
  if (found == session.keyframes.end()) return std::nullopt;
  return found->scans[found->reference_scan].T_odometry_sensor.translation;
}

void add_loops_of_run(const std::filesystem::path& file, const SessionData& session,
                      ResultScene& scene) {
  if (!std::filesystem::exists(file)) return;
  for (const LoopRecord& loop : merge::read_loops_csv(file)) {
    if (!loop.accepted || loop.match_session != loop.query_session) continue;
    const auto from = sensor_position(session, loop.query_keyframe);
    const auto to = sensor_position(session, loop.match_keyframe);
    if (from && to) scene.loops.emplace_back(*from, *to);
  }
}

std::int64_t first_stamp_ns(const ResultScene& scene) {
  std::int64_t first = INT64_MAX;
  for (const SceneTrack& track : scene.tracks) {
    if (!track.poses.empty()) first = std::min(first, track.poses.front().stamp_ns);
  }
  return first == INT64_MAX ? 0 : std::max<std::int64_t>(0, first);
}

/// A scene is one document, which is put together in memory.
std::vector<Eigen::Vector3f> in_memory(const merge::ExternalVector<Eigen::Vector3f>& points) {
  return {points.begin(), points.end()};
}

SceneCloud static_cloud(const merge::ExternalVector<merge::MapPoint>& points) {
  SceneCloud cloud{"/static", {}, {}};
  bool has_intensity = false;
  for (const merge::MapPoint& point : points) {
    cloud.points.push_back(point.position);
    cloud.intensities.push_back(static_cast<std::uint8_t>(point.intensity));
    has_intensity = has_intensity || point.intensity != 0;
  }
  if (!has_intensity) cloud.intensities.clear();
  return cloud;
}

}  // namespace

ResultScene scene_of_run(const std::filesystem::path& run) {
  const SessionData session = read_run(run);
  const merge::MergedSession merged = alone(session);
  ResultScene scene;
  scene.frame = "odometry";
  scene.clouds.push_back(
      static_cloud(merge::session_map(session, merged, Eigen::Vector3d::Zero())));
  scene.clouds.push_back({"/removed", removed_points(session), kRemovedColor});
  scene.tracks.push_back({session.info.name, merge::session_trajectory(session, merged)});
  add_loops_of_run(run / "loops.csv", session, scene);
  return scene;
}

void write_las_of_run(const std::filesystem::path& file, const std::filesystem::path& run) {
  const SessionData session = read_run(run);
  merge::write_session_las(file, session, alone(session));
}

ResultScene scene_of_merge(const std::vector<SessionData>& sessions,
                           const merge::MergeResult& result) {
  ResultScene scene;
  scene.frame = "map";
  SceneCloud appeared{"/appeared", {}, kAppearedColor};
  SceneCloud gone{"/gone", {}, kGoneColor};
  for (const merge::ChangedPoint& point : result.changes) {
    (point.appeared ? appeared : gone).points.push_back(point.position);
  }
  scene.clouds = {static_cloud(result.map),
                  {"/removed", in_memory(result.dynamic_points), kRemovedColor},
                  std::move(appeared),
                  std::move(gone)};
  const auto position = [&](const auto& end) {
    const KeyframeRecord& keyframe = sessions[end.session].keyframes[end.keyframe];
    return (result.sessions[end.session].T_map_keyframe[end.keyframe] *
            merge::reference_sensor_pose(keyframe))
        .translation;
  };
  const auto is_in_map = [&](std::size_t session) {
    return merge::is_in_map(result.sessions[session].status);
  };
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (!is_in_map(s)) continue;
    scene.tracks.push_back(
        {sessions[s].info.name, merge::session_trajectory(sessions[s], result.sessions[s])});
  }
  for (const merge::LoopConstraint& loop : result.loops) {
    if (!loop.decision.accepted || !is_in_map(loop.query.session)) continue;
    scene.loops.emplace_back(position(loop.query), position(loop.match));
  }
  return scene;
}

void write_scene(const std::filesystem::path& file, const ResultScene& scene) {
  bags::FoxgloveWriter writer(file);
  const std::int64_t start_ns = first_stamp_ns(scene);
  for (const SceneCloud& cloud : scene.clouds) {
    writer.write_cloud(cloud.topic, scene.frame, start_ns, cloud.points, cloud.color,
                       cloud.intensities);
  }
  writer.write_lines("/loops", scene.frame, start_ns, "loops", scene.loops, kLoopColor);
  for (const SceneTrack& track : scene.tracks) {
    std::vector<Pose> poses;
    for (const merge::TrajectoryPose& pose : track.poses) poses.push_back(pose.T_map_sensor);
    writer.write_poses("/" + track.session + "/trajectory", scene.frame, start_ns, poses);
    for (const merge::TrajectoryPose& pose : track.poses) {
      const std::int64_t stamp_ns = std::max(start_ns, pose.stamp_ns);
      writer.write_pose("/" + track.session + "/pose", scene.frame, stamp_ns, pose.T_map_sensor);
      writer.write_transform(scene.frame, track.session, stamp_ns, pose.T_map_sensor);
    }
  }
  writer.close();
}

}  // namespace unimapper::apps
