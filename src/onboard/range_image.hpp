// Small spherical images of how far the sensor could see.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// One scan as an image. A pixel holds the *smallest* range met in it and around it, so that
/// what lies nearer than the pixel was certainly seen through, whatever falls between the rays.
/// Without enough returns there is no verdict: a ray that met nothing may have met glass, sky
/// or a black car.
struct RangeImage {
  std::uint16_t* pixels = nullptr;
  std::uint32_t scan = 0;  ///< of the keyframe
  Eigen::Matrix3f R_grid_sensor = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t_grid_sensor = Eigen::Vector3f::Zero();  ///< metres from the grid's origin
};

/// Paints scans into range images.
class RangePainter {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

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
