// Thinning of scans: one point per cell, in two steps.
#pragma once

#include <cstdint>
#include <span>

#include "src/core/fixed_hash_map.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/odometry/config.hpp"

namespace unimapper::odometry {

/// A point of a scan as measured: in the sensor's frame of its own time.
struct ScanPoint {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
  float time_s = 0.0F;  ///< after the scan's stamp
};

/// Takes the first point of every cell.
class ScanThinning {
 public:
  /// Takes room for `config.max_points`.
  void allocate(Arena& arena, const LidarOdometryConfig& config) noexcept;

  /// Thins a scan; `time_s` is empty or has one time per point. Points whose time is not finite, or
  /// seconds away, are left out. O(points).
  void thin(const PointView& points, std::span<const float> time_s) noexcept;

  /// One point per quarter of a voxel: for the map.
  [[nodiscard]] std::span<const ScanPoint> fine() const noexcept { return fine_.values(); }
  /// Indices into `fine()` of fewer points: for the registration. Their cells grow with distance,
  /// or walls far away would outvote the ground nearby, which alone shows roll and pitch.
  [[nodiscard]] std::span<const std::uint32_t> coarse() const noexcept { return coarse_.values(); }
  /// Points of the last scan that found no room.
  [[nodiscard]] std::uint64_t refused() const noexcept { return fine_.refused(); }

 private:
  FixedHashMap<ScanPoint> fine_;
  FixedHashMap<std::uint32_t> coarse_;
  float voxels_per_m_ = 1.0F;
  float min_squared_m2_ = 0.0F;
  float max_squared_m2_ = 0.0F;
};

}  // namespace unimapper::odometry
