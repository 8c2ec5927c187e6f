// Small spherical images of how far the sensor could see.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Which pixel a direction falls into: columns are even in azimuth, rows in the sine of the
/// elevation, so that no arc functions are needed.
class ImageProjection {
 public:
  ImageProjection() = default;
  explicit ImageProjection(const FreeSpaceConfig& config) noexcept;

  static constexpr std::int32_t kOutside = -1;  // all bits set

  /// Pixels and ranges of `count` points in the sensor frame; `kOutside` where the direction is
  /// not within the field of view. Vectorises.
  void project(const float* x, const float* y, const float* z, std::size_t count,
               std::int32_t* pixel, float* range_m) const noexcept;

  [[nodiscard]] std::int32_t columns() const noexcept { return columns_; }
  [[nodiscard]] std::int32_t rows() const noexcept { return rows_; }
  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  }
  /// The leftmost column is next to the rightmost one.
  [[nodiscard]] bool wraps() const noexcept { return wraps_; }

 private:
  std::int32_t columns_ = 0;
  std::int32_t rows_ = 0;
  bool wraps_ = true;
  float columns_per_turn_ = 0.0F;
  float first_turn_ = 0.0F;
  float rows_per_sine_ = 0.0F;
  float first_sine_ = 0.0F;
};

/// Ranges are kept in 1/128 m.
inline constexpr float kRangeUnitsPerMetre = 128.0F;
/// A pixel of which too little is known for a verdict.
inline constexpr std::uint16_t kNoRange = 0;

/// One scan as an image. A pixel holds the *smallest* range met in it and around it, so that
/// what lies nearer than the pixel was certainly seen through, whatever falls between the rays.
/// Without enough returns there is no verdict: a ray that met nothing may have met glass, sky
/// or a black car.
struct RangeImage {
  std::uint16_t* pixels = nullptr;
  Eigen::Matrix3f R_grid_sensor = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t_grid_sensor = Eigen::Vector3f::Zero();  ///< metres from the grid's origin
};

/// Paints scans into range images.
class RangePainter {
 public:
  void attach(Arena& arena, const PipelineConfig& config) noexcept;

  /// Paints the valid points of a scan into `image`. O(points + pixels).
  void paint(const PointView& points, RangeImage& image) noexcept;

  [[nodiscard]] const ImageProjection& projection() const noexcept { return projection_; }

 private:
  void collect(const PointView& points) noexcept;
  void filter(std::uint16_t* pixels) noexcept;

  ImageProjection projection_;
  float range_min_m_ = 0.0F;
  float range_max_m_ = 0.0F;
  std::uint32_t min_returns_ = 3;
  std::size_t max_points_ = 0;
  std::uint16_t* nearest_ = nullptr;  ///< smallest range per pixel, 0xFFFF = no return
  std::uint16_t* row_min_ = nullptr;  ///< horizontal pass of the filter
  std::uint8_t* row_count_ = nullptr;
};

}  // namespace unimapper::onboard
