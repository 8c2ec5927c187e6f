// STD voxels of accumulated scans, and their planes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "bench/places/std_baseline.hpp"

namespace unimapper::bench {

/// Cells as single numbers that sort by x, then y, then z. A step to the next cell along an axis
/// adds a constant.
using StdCell = std::uint64_t;
inline constexpr std::uint32_t kStdCellBits = 21;

/// The cell `steps` away.
[[nodiscard]] StdCell neighbour_cell(StdCell cell, const Eigen::Vector3i& steps);

/// None for points that are not finite or a million cells away.
[[nodiscard]] std::optional<StdCell> cell_of(const Eigen::Vector3d& point, double size_m);

/// One centroid per occupied cell, in the order of the cells.
[[nodiscard]] std::vector<Eigen::Vector3d> cell_centroids(std::span<const Eigen::Vector3d> points,
                                                          double size_m);

struct StdVoxel {
  StdCell cell = 0;
  std::span<const Eigen::Vector3d> points;
  std::optional<StdPlane> plane;
  bool is_continued = false;  ///< a plane one of whose face neighbours is coplanar
};

/// The directions of a voxel's faces.
[[nodiscard]] std::span<const Eigen::Vector3i> std_faces();

/// Voxels in the order of their cells.
class StdVoxels {
 public:
  StdVoxels(std::span<const Eigen::Vector3d> points, const StdConfig& config);
  StdVoxels(const StdVoxels&) = delete;  // the voxels refer to the points
  StdVoxels& operator=(const StdVoxels&) = delete;

  [[nodiscard]] std::span<const StdVoxel> all() const { return voxels_; }
  /// Number within `all()`, none if that cell is empty.
  [[nodiscard]] std::optional<std::uint32_t> find(StdCell cell) const;
  [[nodiscard]] std::vector<StdPlane> planes() const;

 private:
  void sort_points(std::span<const Eigen::Vector3d> points, double size_m);
  void find_planes(const StdConfig& config);
  void connect_planes(double coplanar_normals);

  std::vector<Eigen::Vector3d> points_;
  std::vector<StdVoxel> voxels_;
  std::unordered_map<StdCell, std::uint32_t> numbers_;
};

/// Whether two unit vectors or opposites of theirs differ by less than `tolerance`.
[[nodiscard]] inline bool are_parallel(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                       double tolerance) {
  const double squared = tolerance * tolerance;
  return (a - b).squaredNorm() < squared || (a + b).squaredNorm() < squared;
}

}  // namespace unimapper::bench
