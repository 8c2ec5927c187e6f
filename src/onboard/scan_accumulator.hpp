// Scans in, occupied fine cells out.
#pragma once

#include <cstdint>
#include <span>

#include "grid.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_hash_map.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// The points of one fine cell. Sums are in cell edges from the cell's lower corner, which keeps
/// them exact to a fraction of a millimetre for any number of points.
struct CellSums {
  float x;
  float y;
  float z;
  std::uint32_t points;
};

/// Mean of a cell's points, metres from the grid's origin.
[[nodiscard]] inline Eigen::Vector3f mean_of(const VoxelIndex& cell, const CellSums& sums,
                                             float cell_size_m) noexcept {
  const float inverse = 1.0F / static_cast<float>(sums.points);
  return {(static_cast<float>(cell.x) + sums.x * inverse) * cell_size_m,
          (static_cast<float>(cell.y) + sums.y * inverse) * cell_size_m,
          (static_cast<float>(cell.z) + sums.z * inverse) * cell_size_m};
}

/// Where a point of a scan went: its cell in the lower 24 bits, and in the upper 8 how high in
/// the cell it lies, so that ground and obstacle points of one cell can be told apart later.
using PointCode = std::uint32_t;
inline constexpr PointCode kPointInvalid = 0xFFFFFFFFU;  ///< not finite or out of range
inline constexpr PointCode kPointDropped = 0xFFFFFFFEU;  ///< no room
[[nodiscard]] constexpr std::uint32_t cell_of(PointCode code) noexcept { return code & 0xFFFFFFU; }
[[nodiscard]] constexpr std::uint32_t height_of(PointCode code) noexcept { return code >> 24U; }
/// Both special codes name a cell beyond every capacity.
[[nodiscard]] constexpr bool has_cell(PointCode code) noexcept { return code < kPointDropped; }

/// What became of the points of one scan.
struct ScanCounts {
  std::uint64_t points = 0;
  std::uint64_t valid = 0;
  std::uint64_t not_finite = 0;
  std::uint64_t out_of_range = 0;
  std::uint64_t beyond_capacity = 0;  ///< more points than fit one scan
  std::uint64_t no_cell = 0;          ///< the fine cells were full
};

/// Accumulates the scans of a keyframe (paper section IV-A), one hash look-up per point.
class ScanAccumulator {
 public:
  void attach(Arena& arena, const PipelineConfig& config) noexcept;

  /// Forgets all scans and counts cells in `grid` from now on.
  void begin(const Grid& grid) noexcept;

  /// Adds a scan. One without a valid point adds nothing. At most `KeyframeConfig::scans` times
  /// between two `begin`.
  ScanCounts add(const PointView& points, const Pose& T_odometry_sensor) noexcept;

  [[nodiscard]] const Grid& grid() const noexcept { return grid_; }
  [[nodiscard]] std::uint32_t scans() const noexcept { return scans_; }
  [[nodiscard]] const FixedHashMap<CellSums>& cells() const noexcept { return cells_; }

  /// Codes of the points of a scan in input order; points beyond the capacity have none.
  [[nodiscard]] std::span<const PointCode> codes(std::uint32_t scan) const noexcept;
  /// Points handed over in a scan, with or without code.
  [[nodiscard]] std::size_t points_of(std::uint32_t scan) const noexcept {
    return points_of_[scan];
  }
  /// Most points any scan since `begin` had.
  [[nodiscard]] std::size_t largest_scan() const noexcept;

 private:
  static constexpr std::size_t kBatch = 256;
  struct Batch;

  /// Transforms up to `kBatch` points from `first` on and sorts out the invalid ones.
  void locate(const PointView& points, std::size_t first, Batch& batch,
              ScanCounts& counts) const noexcept;
  void insert(const Batch& batch, PointCode* codes, ScanCounts& counts) noexcept;
  void insert_thinned(const Batch& batch, PointCode* codes, ScanCounts& counts) noexcept;
  PointCode insert_point(const Batch& batch, std::size_t i, ScanCounts& counts) noexcept;

  Grid grid_;
  float range_min_squared_ = 0.0F;
  float range_max_squared_ = 0.0F;
  float cells_per_leaf_inverse_ = 0.0F;  ///< 0: no down-sampling
  std::uint32_t max_points_ = 0;
  std::uint32_t scans_ = 0;
  std::uint32_t points_of_[KeyframeConfig::kMaxScans] = {};
  Eigen::Matrix3f cells_from_sensor_ = Eigen::Matrix3f::Identity();  ///< scale included
  Eigen::Vector3f sensor_in_cells_ = Eigen::Vector3f::Zero();
  PointCode* codes_ = nullptr;
  FixedHashMap<CellSums> cells_;
  FixedHashMap<PointCode> leaves_;
};

}  // namespace unimapper::onboard
