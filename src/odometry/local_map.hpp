// Local map: voxels with the distribution of the points in them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "src/core/fixed_hash_map.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper::odometry {

/// What scan points are registered to: a plane, a pole, or a cluster of points.
struct Surface {
  Eigen::Vector3f mean_m = Eigen::Vector3f::Zero();  ///< relative to the voxel's centre
  /// Upper triangle, row by row. Of a plane or a pole the projection onto the directions across it,
  /// one or two. Of a cluster the inverse covariance along directions in which it is compact, as a
  /// multiple of a plane's.
  float across[6] = {};
  bool is_clear = false;    ///< whether its directions are beyond doubt
  bool is_cluster = false;  ///< neither a plane nor a pole
};

/// One voxel. Each of its 4 x 4 x 4 sub-cells takes one point: the points lie evenly however
/// densely the sensor sees the place, and what is seen again and again stays as it is.
struct MapVoxel {
  std::uint64_t filled = 0;                         ///< sub-cells that hold a point, a bit each
  Eigen::Vector3f sum_m = Eigen::Vector3f::Zero();  ///< of the points, relative to the centre
  float products_m2[6] = {};                        ///< sum of outer products, upper triangle
  Surface surface;                                  ///< where `is_surface`
  std::uint16_t points = 0;                         ///< points that were taken
  bool is_changed = false;                          ///< since `surface` was computed
  bool is_surface = false;                          ///< whether the points show one
};

/// Voxels in fixed memory, kept by distance. Deterministic: their order and what is removed
/// follow from the points alone.
class LocalMap {
 public:
  /// No entry.
  static constexpr std::uint32_t kNone = FixedHashMap<MapVoxel>::kNotFound;

  /// Takes room for so many voxels of `voxel_m` edge. Clusters are compact where their deviation is
  /// at most `compact_m`.
  void allocate(Arena& arena, std::size_t voxels, double voxel_m, double compact_m) noexcept;
  /// Forgets everything. O(1).
  void clear() noexcept;

  /// Adds a point given in the odometry frame, metres. False if there is no room for its voxel.
  bool add(const Eigen::Vector3d& point_m) noexcept;

  /// Drops voxels farther than `radius_m` from `centre_m`. Each call looks at a sixteenth of all:
  /// the time of a call is bounded, and what is far is gone some calls later. Entries change.
  void forget_far(const Eigen::Vector3d& centre_m, double radius_m) noexcept;

  /// The eight voxels nearest to a point, and which of them has the surface whose mean is nearest.
  struct Neighbourhood {
    std::uint32_t entry = kNone;  ///< `kNone` if none has a surface
    VoxelIndex lowest{std::numeric_limits<std::int32_t>::max(), 0, 0};  ///< of the eight
  };
  /// Brings the neighbourhood to that of a point. Cheap if it is already. Not for a changed map.
  void find_nearest(const Eigen::Vector3d& point_m, Neighbourhood& neighbourhood) noexcept {
    const Eigen::Vector3d scaled = point_m * per_m_;
    const Eigen::Vector3d from = scaled.array() - 0.5;
    const VoxelIndex& low = neighbourhood.lowest;
    const auto is_in = [](double value, std::int32_t i) { return value >= i && value < i + 1.0; };
    if (is_in(from.x(), low.x) && is_in(from.y(), low.y) && is_in(from.z(), low.z)) return;
    look(scaled, from, neighbourhood);
  }

  /// A voxel by its entry.
  [[nodiscard]] const MapVoxel& voxel(std::uint32_t entry) const noexcept { return voxels_[entry]; }
  /// Middle of a voxel, odometry frame, metres.
  [[nodiscard]] Eigen::Vector3d centre(std::uint32_t entry) const noexcept;
  /// Voxels in use.
  [[nodiscard]] std::uint32_t size() const noexcept { return voxels_.size(); }

 private:
  void look(const Eigen::Vector3d& scaled, const Eigen::Vector3d& from,
            Neighbourhood& neighbourhood) noexcept;
  void update_surface(MapVoxel& voxel) const noexcept;

  FixedHashMap<MapVoxel> voxels_;
  double voxel_m_ = 1.0;
  double per_m_ = 1.0;
  float compact_m2_ = 0.0F;   // variance
  std::uint32_t cursor_ = 0;  // where `forget_far` goes on
};

}  // namespace unimapper::odometry
