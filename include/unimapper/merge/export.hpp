// Export of a merged map to files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "unimapper/merge/merger.hpp"
#include "unimapper/merge/navigation_grid.hpp"

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

/// A part of the map frame, faces included.
struct MapBox {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();   ///< metres
  Eigen::Vector3d high = Eigen::Vector3d::Zero();  ///< metres
};

/// The coordinate system of the site frame: projected, metres, as a person says.
struct CoordinateSystem {
  std::string name;  ///< as in "EPSG:25832"; empty: not known
  std::string wkt;   ///< OGC 01-009 ("WKT 1")
};

/// How much of a map is written, and in which form.
struct ExportOptions {
  std::optional<MapBox> box;        ///< only points in it: map, changes, removed, tiles
  double voxel_m = 0.0;             ///< one point of the map per so large a voxel; 0: all
  double tile_m = 0.0;              ///< edge of tiles that the map is written in, too; 0: none
  bool las = false;                 ///< map and tiles as LAS files, too
  CoordinateSystem crs;             ///< of the site frame, for LAS files and the summary
  std::optional<GridOptions> grid;  ///< none: no grid is written
};

/// Writes into `folder`, which is made if it does not exist:
///  - trajectories/<session>.tum: "stamp x y z qx qy qz qw" per scan, map frame; sessions that
///    are not connected go to unconnected/<session>.tum in their own frame
///  - graph.g2o: VERTEX_SE3:QUAT, FIX and EDGE_SE3:QUAT of the final pose graph
///  - loops.csv: every loop considered, accepted or why not, between sensor frames
///  - map.ply, changes.ply, removed.ply: binary; coloured by session, green for appeared and red
///    for gone, without a colour
///  - tiles/X_Y.ply: as map.ply; a tile begins at X and Y times its edge
///  - map.las, tiles/X_Y.las, if asked for: the same points as LAS 1.4, in the site frame
///  - grid.pgm, grid.yaml: the navigation grid as ROS's map server reads it
///  - georeference.json, if positions are known: where the map lies in the site frame
///  - summary.json: the same bytes for the same input; timing.json: the stages' durations
/// Throws std::runtime_error naming the file that cannot be written, and for a grid that would be
/// too large, and a coordinate system for a map that no position places. Returns the grid, for what
/// it has to say.
std::optional<NavigationGrid> export_map(const std::filesystem::path& folder,
                                         const std::vector<SessionData>& sessions,
                                         const MergeResult& result,
                                         const ExportOptions& options = {});

/// The static cells of a session alone, their mean in each 0.2 m; `placed` is in its odometry
/// frame, of which the points lie `origin` off. O(cells).
[[nodiscard]] ExternalVector<MapPoint> session_map(const SessionData& session, MergedSession placed,
                                                   const Eigen::Vector3d& origin);
/// Those as a LAS file. Throws std::runtime_error.
void write_session_las(const std::filesystem::path& path, const SessionData& session,
                       MergedSession placed);

/// A binary PLY file of positions alone, metres. Throws std::runtime_error.
void write_positions(const std::filesystem::path& path,
                     const ExternalVector<Eigen::Vector3f>& points);

}  // namespace unimapper::merge
