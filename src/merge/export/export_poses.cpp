// Trajectories, pose graph and loops of a merged map as files.
#include <algorithm>
#include <cstdio>
#include <string>

#include "export_files.hpp"
#include "loops_csv.hpp"
#include "src/core/pose_interpolation.hpp"

namespace unimapper::merge {
namespace {

std::string numbers(const Pose& pose, const char* separator, const char* format) {
  const Eigen::Quaterniond q = canonical_quaternion(pose);
  const double values[] = {
      pose.translation.x(), pose.translation.y(), pose.translation.z(), q.x(), q.y(), q.z(), q.w()};
  std::string text;
  for (const double value : values) {
    char number[40];
    std::snprintf(number, sizeof number, format, value == 0.0 ? 0.0 : value);
    if (!text.empty()) text += separator;
    text += number;
  }
  return text;
}

/// Seconds with nine decimals, exact: no detour over a double, which would lose nanoseconds.
std::string seconds(std::int64_t stamp_ns) {
  const bool negative = stamp_ns < 0;
  const std::uint64_t magnitude =
      negative ? 0 - static_cast<std::uint64_t>(stamp_ns) : static_cast<std::uint64_t>(stamp_ns);
  char text[40];
  std::snprintf(text, sizeof text, "%s%llu.%09llu", negative ? "-" : "",
                static_cast<unsigned long long>(magnitude / 1000000000ULL),
                static_cast<unsigned long long>(magnitude % 1000000000ULL));
  return text;
}

/// First vertex number of every session.
std::vector<std::size_t> first_vertices(const std::vector<SessionData>& sessions) {
  std::vector<std::size_t> first;
  std::size_t next = 0;
  for (const auto& session : sessions) {
    first.push_back(next);
    next += session.keyframes.size();
  }
  return first;
}

}  // namespace

Pose reference_sensor_pose(const KeyframeRecord& keyframe) {
  return keyframe.T_odometry_keyframe.inverse() *
         keyframe.scans[keyframe.reference_scan].T_odometry_sensor;
}

std::vector<TrajectoryPose> session_trajectory(const SessionData& session,
                                               const MergedSession& merged) {
  // Pose of a scan by odometry relative to a keyframe of the optimised graph.
  const auto relative_to = [&](std::size_t k, const Pose& T_odometry_sensor) {
    return merged.T_map_keyframe[k] * session.keyframes[k].T_odometry_keyframe.inverse() *
           T_odometry_sensor;
  };
  const auto reference_ns = [&](std::size_t k) {
    const auto& keyframe = session.keyframes[k];
    return keyframe.scans[keyframe.reference_scan].stamp_ns;
  };
  std::vector<TrajectoryPose> trajectory;
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    for (const auto& scan : session.keyframes[k].scans) {
      // The two keyframes whose reference scans lie around this scan.
      const bool before = scan.stamp_ns < reference_ns(k);
      const std::size_t first = before && k > 0 ? k - 1 : k;
      const std::size_t second = before ? k : std::min(k + 1, session.keyframes.size() - 1);
      Pose pose = relative_to(first, scan.T_odometry_sensor);
      const std::int64_t span = reference_ns(second) - reference_ns(first);
      if (second != first && span > 0) {
        const double share =
            static_cast<double>(scan.stamp_ns - reference_ns(first)) / static_cast<double>(span);
        pose = interpolate(pose, relative_to(second, scan.T_odometry_sensor),
                           std::clamp(share, 0.0, 1.0));
      }
      trajectory.push_back({scan.stamp_ns, pose});
    }
  }
  std::stable_sort(
      trajectory.begin(), trajectory.end(),
      [](const TrajectoryPose& a, const TrajectoryPose& b) { return a.stamp_ns < b.stamp_ns; });
  return trajectory;
}

void write_trajectory(const std::filesystem::path& path, const Eigen::Vector3d& origin,
                      const SessionData& session, const MergedSession& merged) {
  OutputFile file(path);
  for (TrajectoryPose& pose : session_trajectory(session, merged)) {
    pose.T_map_sensor.translation += origin;
    file.stream() << seconds(pose.stamp_ns) << ' ' << numbers(pose.T_map_sensor, " ", "%.9f")
                  << '\n';
  }
  file.close();
}

void write_pose_graph(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                      const MergeResult& result) {
  OutputFile file(path);
  const auto first = first_vertices(sessions);
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      file.stream() << "VERTEX_SE3:QUAT " << first[s] + k << ' '
                    << numbers(result.sessions[s].T_map_keyframe[k], " ", "%.9f") << '\n';
    }
  }
  // One fixed vertex per piece of the graph: the central map's, and each unconnected session's.
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (result.sessions[s].status != SessionStatus::kMerged && !sessions[s].keyframes.empty()) {
      file.stream() << "FIX " << first[s] << '\n';
    }
  }
  for (const auto& edge : result.graph_edges) {
    file.stream() << "EDGE_SE3:QUAT " << first[edge.match.session] + edge.match.keyframe << ' '
                  << first[edge.query.session] + edge.query.keyframe << ' '
                  << numbers(edge.T_match_query, " ", "%.9f");
    // g2o measures the translation's error in the frame of the second vertex.
    Matrix6d turn = Matrix6d::Identity();
    turn.topLeftCorner<3, 3>() = edge.T_match_query.rotation;
    const Matrix6d information = turn.transpose() * edge.information * turn;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        char number[40];
        std::snprintf(number, sizeof number, " %.9g", information(row, column));
        file.stream() << number;
      }
    }
    file.stream() << '\n';
  }
  file.close();
}

void write_loops(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                 const MergeResult& result) {
  std::vector<LoopRecord> records;
  records.reserve(result.loops.size());
  for (const auto& loop : result.loops) {
    const auto& query = sessions[loop.query.session].keyframes[loop.query.keyframe];
    const auto& match = sessions[loop.match.session].keyframes[loop.match.keyframe];
    LoopRecord& record = records.emplace_back();
    record.query_session = sessions[loop.query.session].info.name;
    record.query_keyframe = query.sequence;
    record.query_scan = query.scans[query.reference_scan].scan_index;
    record.match_session = sessions[loop.match.session].info.name;
    record.match_keyframe = match.sequence;
    record.match_scan = match.scans[match.reference_scan].scan_index;
    record.confidence = static_cast<double>(loop.confidence);
    record.accepted = loop.decision.accepted;
    record.reason = loop.decision.reason;
    record.T_match_query =
        reference_sensor_pose(match).inverse() * loop.T_match_query * reference_sensor_pose(query);
  }
  OutputFile file(path);
  file.stream() << format_loops_csv(records);
  file.close();
}

}  // namespace unimapper::merge
