// STD baseline: the published triangle descriptor for place recognition.
//
// Reimplemented from the published program, including its weaknesses: keypoints by point counts,
// equal neighbours that suppress each other, the pose of a single triangle, a plane overlap whose
// neighbours may be at any distance. Results are reproducible: voxels have an order. Places with
// few keypoints do not read beyond memory.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::bench {

/// STD's parameters with the values of the Uni-Mapper paper. Those of no test are in the source.
struct StdConfig {
  int segment_pixels = 5;           ///< one keypoint at most in a square of so many pixels a side
  double corner_min_points = 10;    ///< a keypoint's pixel holds so many at least
  std::size_t max_keypoints = 100;  ///< those of most points
  double side_tolerance = 0.015;    ///< difference of the three sides, relative to their norm
  double count_tolerance = 0.5;     ///< difference of the three counts, relative to their mean
  std::size_t min_votes = 5;        ///< matching triangles of a candidate
  std::ptrdiff_t min_agreeing = 4;  ///< triangles, the one that gives the pose included
  static constexpr double kAcceptScore = 0.35;  ///< of a loop; `StdDatabase` does not apply it
};

/// Vertex of a triangle.
struct StdKeypoint {
  Eigen::Vector3d position;  ///< on the plane it was projected to
  Eigen::Vector3d normal;    ///< of that plane
  double count;              ///< points in its pixel
};
/// One voxel's plane.
struct StdPlane {
  Eigen::Vector3d center;
  Eigen::Vector3d normal;
};
/// STD descriptor of a keyframe, in the frame of its scans' poses.
struct StdPlace {
  std::vector<StdKeypoint> keypoints;
  std::vector<StdPlane> planes;
};
using StdCloud = std::vector<Eigen::Vector3d>;

/// Adds a scan to a cloud, downsampled by itself: counts grow with the number of scans. Points that
/// are not finite, or 100 km away, are ignored.
void add_scan(const PointView& sensor_points, const Pose& T_world_sensor, StdCloud& cloud);
/// Describes accumulated scans; STD takes ten, in the odometry frame.
[[nodiscard]] StdPlace describe_cloud(const StdCloud& cloud);

/// Cells as single numbers that sort by x, then y, then z.
using StdCell = std::uint64_t;
[[nodiscard]] StdCell neighbour_cell(StdCell cell, const Eigen::Vector3i& steps);
/// None for points that are not finite or a million cells away.
[[nodiscard]] std::optional<StdCell> cell_of(const Eigen::Vector3d& point, double size_m);

/// What lies in a cell of 2 m.
struct StdVoxel {
  StdCloud points;
  std::optional<StdPlane> plane;
  bool is_continued = false;  ///< a plane one of whose face neighbours is coplanar
};
using StdVoxels = std::map<StdCell, StdVoxel>;
[[nodiscard]] StdVoxels find_voxels(const StdCloud& cloud);
/// The densest pixels of the images of voxels without a plane.
[[nodiscard]] std::vector<StdKeypoint> find_corners(const StdVoxels& voxels,
                                                    const StdConfig& config = {});
/// Corners that no other within 2 m equals or exceeds, of these those of most points, densest
/// first.
[[nodiscard]] std::vector<StdKeypoint> select_keypoints(const std::vector<StdKeypoint>& corners,
                                                        const StdConfig& config = {});

/// Vertices are ordered by their adjacent sides: the two shorter ones, the shortest and the
/// longest, the two longer ones.
struct StdTriangle {
  Eigen::Vector3d sides;    ///< ascending, in cells of the hash table (0.2 m)
  Eigen::Vector3d counts;   ///< of the vertices
  Eigen::Matrix3d corners;  ///< the vertices, one in each column
};
/// Of several triangles with equal sides (to the millimetre) only the first is kept, even if the
/// others have other vertices.
[[nodiscard]] std::vector<StdTriangle> form_triangles(const std::vector<StdKeypoint>& keypoints);

/// The best match of a query.
struct StdLoop {
  std::uint32_t match = 0;  ///< what `StdDatabase::insert` returned for it
  double score = 0.0;       ///< share of the query's planes found in it, [0, 1]
  std::size_t votes = 0;    ///< pairs of similar triangles, before their poses were compared
  Pose T_match_query;       ///< between the frames the places are in
};

/// Places and their triangles. It has no notion of time: to search within a drive, insert places
/// late (STD leaves the last 30 out).
class StdDatabase {
 public:
  explicit StdDatabase(const StdConfig& config = {}) : config_(config) {}
  /// Returns the place's number: 0, 1, 2...
  std::uint32_t insert(const StdPlace& place);
  /// The candidate of the highest score, whatever it is, so that callers may sweep the threshold;
  /// none if no candidate had enough agreeing triangles.
  [[nodiscard]] std::optional<StdLoop> search(const StdPlace& query) const;

 private:
  StdConfig config_;
  std::vector<std::vector<StdPlane>> planes_;  ///< of every place, ascending in x
  /// Triangles by their sides, with the places that they are of.
  std::unordered_map<StdCell, std::vector<std::pair<std::uint32_t, StdTriangle>>> cells_;
};

/// File of a drive's descriptions, so that its scans need not be kept: doubles as they lie in
/// memory, for the machine that wrote it. Throws std::runtime_error.
void write_std_file(const std::filesystem::path& file, const std::vector<StdPlace>& places);
/// Throws std::runtime_error if it is no such file, or not all of it.
[[nodiscard]] std::vector<StdPlace> read_std_file(const std::filesystem::path& file);

}  // namespace unimapper::bench
