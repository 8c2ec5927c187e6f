// STD baseline: the published triangle descriptor for place recognition.
//
// Reimplemented from the published program, including its weaknesses: keypoints by point counts,
// equal neighbours that suppress each other, the pose of a single triangle, a plane overlap whose
// neighbours may be at any distance. Where that program depends on the order of a hash table,
// voxels are visited in the order of their cells (x, then y, then z), so that results are
// reproducible. The one correction: places with fewer keypoints than a triangle's neighbours do not
// read beyond memory.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::bench {

/// STD's parameters with the values of the Uni-Mapper paper. Differences of normals are those of
/// unit vectors, 0.1 is 5.7 degrees.
struct StdConfig {
  // Description.
  double downsample_m = 0.1;            ///< every scan becomes the centroids of such cells
  double voxel_size_m = 2.0;            ///< of planes and boundaries
  std::uint32_t voxel_min_points = 10;  ///< voxels with more points are planes or boundaries
  double plane_max_variance_m2 = 0.01;  ///< a plane's smallest eigenvalue is below
  double coplanar_normals = 0.1;        ///< face neighbours whose normals differ by less continue
  double pixel_m = 0.5;                 ///< of a boundary's image on its neighbour's plane
  std::uint32_t segment_pixels = 5;  ///< one keypoint at most in a square of so many pixels a side
  double projection_min_m = 0.0;     ///< points from this far off the plane on are projected
  double projection_max_m = 5.0;     ///< and up to here
  double projected_normals = 0.5;    ///< no voxel is projected twice onto normals this similar
  std::uint32_t corner_min_points = 10;  ///< a keypoint's pixel holds so many at least
  double suppression_radius_m = 2.0;     ///< of two keypoints this close at most one survives
  std::uint32_t max_keypoints = 100;     ///< those of most points

  // Triangles.
  std::uint32_t neighbours = 20;   ///< a keypoint's nearest, itself included, form its triangles
  double min_side_m = 2.0;         ///< shortest side
  double max_side_m = 30.0;        ///< longest side
  double side_resolution_m = 0.2;  ///< cell of the hash table

  // Search.
  double side_tolerance = 0.015;      ///< difference of the three sides, relative to their norm
  bool tests_counts = true;           ///< whether matching triangles need similar point counts
  double count_tolerance = 0.5;       ///< difference of the three counts, relative to their mean
  std::uint32_t min_votes = 5;        ///< matching triangles of a candidate
  std::uint32_t max_candidates = 50;  ///< places that are verified
  std::uint32_t max_hypotheses = 50;  ///< triangles per candidate whose pose is tried
  double agreement_m = 3.0;           ///< a triangle agrees if all its vertices fall this close
  std::uint32_t min_agreeing = 4;     ///< triangles, the one that gives the pose included

  // Verification.
  std::uint32_t overlap_neighbours = 3;  ///< planes nearest to a query's, however far, may match it
  double overlap_normals = 0.2;          ///< difference of matching planes' normals
  double overlap_distance_m = 0.5;       ///< of a plane's centre from the matching plane
  double accept_score = 0.35;  ///< STD's threshold of a loop; `StdDatabase` does not apply it
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

/// Accumulates scans and describes them. STD describes ten at a time, in the odometry frame; the
/// caller chooses points and frame.
class StdDescriber {
 public:
  explicit StdDescriber(const StdConfig& config = {}) : config_(config) {}
  /// Points that are not finite, or 100 km away, are ignored.
  void add_scan(std::span<const Eigen::Vector3f> sensor_points, const Pose& T_world_sensor);
  /// Describes the accumulated points and clears them.
  [[nodiscard]] StdPlace describe();

 private:
  StdConfig config_;
  std::vector<Eigen::Vector3d> cloud_;
};

/// The best match of a query.
struct StdLoop {
  std::uint32_t match = 0;  ///< what `StdDatabase::insert` returned for it
  double score = 0.0;       ///< share of the query's planes found in it, [0, 1]
  std::uint32_t votes = 0;  ///< pairs of similar triangles, before their poses were compared
  Pose T_match_query;       ///< between the frames the places are in
};

/// Places and their triangles. It has no notion of time: to search within a drive, insert places
/// late (STD leaves the last 30 out).
class StdDatabase {
 public:
  explicit StdDatabase(const StdConfig& config = {});
  ~StdDatabase();
  StdDatabase(StdDatabase&&) noexcept;
  StdDatabase& operator=(StdDatabase&&) noexcept;

  /// Returns the place's number: 0, 1, 2...
  std::uint32_t insert(StdPlace place);
  /// The candidate of the highest score, whatever it is, so that callers may sweep the threshold;
  /// none if no candidate had enough agreeing triangles.
  [[nodiscard]] std::optional<StdLoop> search(const StdPlace& query) const;
  /// Number of stored triangles.
  [[nodiscard]] std::size_t triangles() const { return triangle_count_; }

 private:
  struct Stored;
  struct Entry;

  StdConfig config_;
  std::vector<Stored> places_;
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
  std::size_t triangle_count_ = 0;
};

}  // namespace unimapper::bench
