// Angular sampling of a spinning LiDAR, measured from a scan
#pragma once

#include <cstdint>

#include "sampling.hpp"
#include "src/onboard/slice.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/point_view.hpp"

namespace unimapper::onboard {

/// What a scan says of its sensor.
struct SamplingEstimate {
  bool valid = false;  ///< false: too few rays, or no rings; the rest of `sampling` is 0 then
  Sampling sampling;   ///< medians
  /// Lowest and highest ray in the frame of the points, but for one in two hundred; both 0 without
  /// points.
  float elevation_min_deg = 0.0F;
  float elevation_max_deg = 0.0F;
};

/// Measures how far apart the rays of a spinning sensor are, whatever the order of its points and
/// however its axis is tilted in their frame: in a few patches of the sphere the points are sorted
/// by their elevation about the axis, where rings stand apart, and along each ring. The axis is the
/// one about which the elevations of a patch concentrate most; upright, if that is as good.
class SamplingEstimator {
 public:
  void allocate(Arena& arena) noexcept;

  /// Begins to measure a scan.
  void begin() noexcept;
  /// The next slice: 65,536 points, a few of the 16 patches, or one search for the axis. Points
  /// outside [range_min_m, range_max_m] are left out. False once the scan is measured.
  bool step(const PointView& points, float range_min_m, float range_max_m) noexcept;
  /// What was measured.
  [[nodiscard]] const SamplingEstimate& estimate() const noexcept { return estimate_; }

 private:
  /// What it does, in this order.
  enum class Task : std::uint8_t { kCount, kCollect, kSlopes, kAxis, kRestOfAxis, kGaps, kDone };

  static constexpr std::uint32_t kPatches = 16;
  static constexpr std::uint32_t kPatchPoints = 1024;
  static constexpr std::uint32_t kGaps = 8192;
  static constexpr std::uint32_t kMaxCells = 60 * 12;
  static constexpr std::uint32_t kSineBins = 512;
  static constexpr std::uint32_t kBins = 512;
  static constexpr std::int32_t kMaxSlope_deg = 30;
  static constexpr std::uint32_t kSlopes = 2 * kMaxSlope_deg + 1;
  static constexpr std::uint8_t kNoPatch = 0xFF;

  /// A ray, and where it points about an axis, degrees.
  struct Ray {
    Eigen::Vector3f direction;
    float azimuth_deg;
    float elevation_deg;
  };
  struct Patch {
    std::uint32_t size;
    Ray rays[kPatchPoints];
    [[nodiscard]] Eigen::Vector3f center() const noexcept;
  };
  struct Gaps {
    std::uint32_t size = 0;
    float* values_deg = nullptr;
    void add(float gap_deg) noexcept {
      if (size < kGaps) values_deg[size++] = gap_deg;
    }
    /// Median, and the share of the gaps within a quarter of it.
    float median(float& share) noexcept;
  };
  /// Axis by its slope against z along x and y, degrees (tan ~ angle).
  struct Axis {
    float x_deg = 0.0F;
    float y_deg = 0.0F;
    [[nodiscard]] Eigen::Vector3f direction() const noexcept;
  };

  /// Calls `visit(direction, range, cell)` for every point within range.
  template <typename Visit>
  void for_each_ray(const PointView& points, float range_min_m, float range_max_m,
                    const Visit& visit) const noexcept;
  void count(const PointView& points, float range_min_m, float range_max_m) noexcept;
  void find_elevations() noexcept;
  void choose_patches() noexcept;
  void collect(const PointView& points, float range_min_m, float range_max_m) noexcept;
  void score_slopes(const Patch& patch, float* scores) noexcept;
  /// The axis to a degree, by the scores of the slopes.
  void find_axis() noexcept;
  /// Tries the `i`-th of 25 axes around it.
  void try_axis(std::uint32_t i) noexcept;
  void conclude() noexcept;
  [[nodiscard]] float score(const Axis& axis) noexcept;
  void add_gaps(Patch& patch, const Axis& axis) noexcept;
  void add_ring(Ray* rays, std::uint32_t count) noexcept;

  Task task_ = Task::kDone;
  SlicedLoop loop_;
  SamplingEstimate estimate_;
  std::uint32_t rays_ = 0;
  Axis coarse_;                           ///< to a degree
  Axis axis_;                             ///< the best so far
  float axis_score_ = 0.0F;               ///< that a better axis must exceed
  ImageProjection grid_;                  ///< of the cells that patches are chosen from
  std::uint32_t* cell_points_ = nullptr;  ///< points per cell
  std::uint8_t* patch_of_ = nullptr;      ///< by cell
  std::uint32_t* sines_ = nullptr;        ///< histogram of the elevations' sines
  std::uint32_t* bins_ = nullptr;
  float* scores_ = nullptr;  ///< kSlopes for each patch
  std::uint32_t patch_count_ = 0;
  Patch* patches_ = nullptr;
  Gaps along_;   ///< a ring
  Gaps across_;  ///< from ring to ring
};

}  // namespace unimapper::onboard
