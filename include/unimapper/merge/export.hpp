// Export of a merged map to files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// The pose of one scan's sensor.
struct TrajectoryPose {
  std::int64_t stamp_ns = 0;  ///< time of the scan
  Pose T_map_sensor;          ///< sensor frame to map frame, metres
};

/// One pose per scan, in the order of time: between keyframes the correction the pose graph made
/// to odometry is interpolated along the way, so the trajectory has no steps. Unconnected sessions
/// are in their own frame.
std::vector<TrajectoryPose> session_trajectory(const SessionData& session,
                                               const MergedSession& merged);

/// T_keyframe_sensor at the keyframe's reference scan.
Pose reference_sensor_pose(const KeyframeRecord& keyframe);

/// Writes into `folder`, which is made if it does not exist:
///  - trajectories/<session>.tum: "stamp x y z qx qy qz qw" per scan, map frame; sessions that
///    are not connected go to unconnected/<session>.tum in their own frame
///  - graph.g2o: VERTEX_SE3:QUAT, FIX and EDGE_SE3:QUAT of the final pose graph
///  - loops.csv: every loop considered, accepted or why not, between sensor frames
///  - map.ply, changes.ply: binary, coloured by session, and green for appeared, red for gone
///  - summary.json: the same bytes for the same input; timing.json: the stages' durations
/// Throws std::runtime_error naming the file that cannot be written.
void export_map(const std::filesystem::path& folder, const std::vector<SessionData>& sessions,
                const MergeResult& result);

}  // namespace unimapper::merge
