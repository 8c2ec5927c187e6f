// Files of an exported map.
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "src/merge/export/las.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::merge {

/// A file opened for writing. `close()` says whether everything arrived.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path)
      : path_(path), stream_(path, std::ios::binary | std::ios::trunc) {
    if (!stream_) throw std::runtime_error(path_.string() + ": cannot be created");
  }
  std::ofstream& stream() { return stream_; }
  void close() {
    stream_.close();
    if (!stream_) throw std::runtime_error(path_.string() + ": cannot be written (disk full?)");
  }

 private:
  std::filesystem::path path_;
  std::ofstream stream_;
};

/// The one of the two quaternions of a rotation with w >= 0.
inline Eigen::Quaterniond canonical_quaternion(const Pose& pose) {
  Eigen::Quaterniond q = pose.quaternion();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

/// TUM, in the frame of the odometry: `origin` is added to the poses' coordinates.
void write_trajectory(const std::filesystem::path& path, const Eigen::Vector3d& origin,
                      const SessionData& session, const MergedSession& merged);
void write_pose_graph(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                      const MergeResult& result);
void write_loops(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                 const MergeResult& result);
/// One file per tile that has points; with `las` a LAS file beside it.
void write_tiles(const std::filesystem::path& folder, const ExternalVector<MapPoint>& points,
                 double tile_m, const LasFrame* las = nullptr);
void write_map_points(const std::filesystem::path& path, const ExternalVector<MapPoint>& points);
void write_changed_points(const std::filesystem::path& path,
                          const std::vector<ChangedPoint>& points);
/// changes.json: the objects in the box of `options`, numbered as the points of changes.ply are.
void write_changed_objects(const std::filesystem::path& path,
                           const std::vector<SessionData>& sessions, const MergeResult& result,
                           const ExportOptions& options);
/// NAME.pgm and NAME.yaml.
void write_grid(const std::filesystem::path& folder, const std::string& name,
                const NavigationGrid& grid);
/// Makes a folder and those above it.
void make_folder(const std::filesystem::path& folder);
void write_summary(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                   const MergeResult& result, const CoordinateSystem& crs = {});
/// georeference.json: where the map lies in the site frame, and what became of each position.
void write_georeference(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                        const MergeResult& result, const CoordinateSystem& crs = {});
void write_timing(const std::filesystem::path& path, const MergeResult& result);

}  // namespace unimapper::merge
