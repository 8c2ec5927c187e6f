// Planes of a scan by the direction they are seen in
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "unimapper/core/arena.hpp"

namespace unimapper::onboard {

/// A plane that the points of one scan in a narrow range of directions lie on, sensor's frame.
struct DirectionPlane {
  Eigen::Vector3f mean_m;
  Eigen::Vector3f normal;
  float reach_m2 = 0.0F;  ///< squared distance from the mean up to which it is known; 0: no plane
};

/// Divides the directions about the sensor by a cube around it, and fits a plane to the points of
/// each of its squares. So cells grow with the range, as the spacing of points does.
class DirectionPlanes {
 public:
  void allocate(Arena& arena) noexcept;
  /// Forgets the scan. The squares of the next one are so large that twelve of its points lie in
  /// one of them, if they lie as those of this one.
  void clear() noexcept;
  /// Adds a point that is finite and not zero. What finds no room is left out.
  void add(const Eigen::Vector3f& point_m) noexcept;
  /// Fits planes to all points added; about 0.2 us a square.
  void fit() noexcept;
  /// The plane in a point's direction, or null.
  [[nodiscard]] const DirectionPlane* find(const Eigen::Vector3f& point_m) const noexcept;
  /// Planes that `fit` found.
  [[nodiscard]] std::uint32_t planes() const noexcept { return planes_; }

 private:
  static constexpr std::uint32_t kFewestEdge = 12;
  static constexpr std::uint32_t kMostEdge = 40;
  static constexpr std::uint32_t kSquares = 6 * kMostEdge * kMostEdge;
  static constexpr std::uint32_t kCells = 1024;  ///< squares with points

  /// Sums of the points of a square, relative to the first one.
  struct Sums {
    Eigen::Vector3f first_m;
    Eigen::Vector3f sum_m;
    float products_m2[6];  ///< upper triangle
    std::uint32_t points;
  };
  struct Cell {
    Sums sums;
    DirectionPlane plane;
  };

  [[nodiscard]] std::uint32_t square_of(const Eigen::Vector3f& point_m) const noexcept;
  [[nodiscard]] static DirectionPlane fit(const Sums& sums) noexcept;

  std::uint16_t* index_ = nullptr;  ///< of the cell of a square, from 1 on; 0: none
  Cell* cells_ = nullptr;
  std::uint32_t edge_ = 20;   ///< squares along the edge of a face
  std::uint32_t points_ = 0;  ///< that were added
  std::uint32_t size_ = 0;
  std::uint32_t planes_ = 0;
};

}  // namespace unimapper::onboard
