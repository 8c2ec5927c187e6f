// Grid of the cells of a keyframe on the wire
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "src/core/voxel_key.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::wire {

/// Blocks per axis, and cells per axis of a block.
inline constexpr std::int32_t kGridBlocks = 256;
inline constexpr std::int32_t kBlockCells = 32;

/// Parts of a cell per axis, in which its mean may lie.
inline constexpr std::array<std::int32_t, 3> kCellParts{2, 2, 3};

/// Where the mean of a cell lies: cells counted from the grid's first one, and the part of the
/// cell.
struct GridPosition {
  std::array<std::int32_t, 3> cell;
  std::array<std::int32_t, 3> part;
};

/// The robot's own grid of fine cells: aligned with the odometry frame, so that there is one mean
/// in a cell, around the keyframe. The same on every processor: sums and products in a fixed order.
class CellGrid {
 public:
  /// `T_odometry_keyframe` is finite and rigid, `cell_size_m` positive.
  CellGrid(const Pose& T_odometry_keyframe, double cell_size_m) noexcept
      : rotation_(T_odometry_keyframe.rotation),
        inverse_(inverse_of(T_odometry_keyframe.rotation)),
        size_m_(cell_size_m) {
    const double block_m = kBlockCells * size_m_;
    for (int axis = 0; axis < 3; ++axis) {
      const double t = T_odometry_keyframe.translation[axis];
      shift_m_[axis] = t - (whole_part_below(t / block_m) - kGridBlocks / 2) * block_m;
    }
  }

  /// Where a position in the keyframe's frame lies, or nothing if it is not finite or outside.
  [[nodiscard]] std::optional<GridPosition> find(const Eigen::Vector3f& position) const noexcept {
    const Eigen::Vector3d turned = product(rotation_, position.cast<double>());
    GridPosition at;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const double cells = (turned[axis] + shift_m_[axis]) / size_m_;
      if (!(cells >= 0.0 && cells < kGridBlocks * kBlockCells)) return std::nullopt;
      at.cell[a] = static_cast<std::int32_t>(cells);
      at.part[a] = static_cast<std::int32_t>((cells - at.cell[a]) * kCellParts[a]);
    }
    return at;
  }

  /// The position that stands for a part of a cell, in the keyframe's frame.
  [[nodiscard]] Eigen::Vector3f position(const GridPosition& at) const noexcept {
    Eigen::Vector3d turned;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      turned[axis] =
          (at.cell[a] + within_cell(at.part[a], kCellParts[a])) * size_m_ - shift_m_[axis];
    }
    return product(inverse_, turned).cast<float>();
  }

 private:
  // std::floor is a call into the maths library on ARMv7; from 2^52 on every double is whole.
  static double whole_part_below(double value) noexcept {
    constexpr double kAllWhole = 4503599627370496.0;
    if (!(value > -kAllWhole && value < kAllWhole)) return value;
    return static_cast<double>(floor_to<std::int64_t>(value));
  }

  // Means of many points lie nearer to the middle of their cell than to its faces: measured, the
  // mean of those in a half lies at 0.287 of the edge, not at 0.25.
  static double within_cell(std::int32_t part, std::int32_t parts) noexcept {
    constexpr std::array<double, 2> kOfTwo{0.2875, 0.7125};
    constexpr std::array<double, 3> kOfThree{0.5 / 3, 1.5 / 3, 2.5 / 3};
    return parts == 2 ? kOfTwo[static_cast<std::size_t>(part)]
                      : kOfThree[static_cast<std::size_t>(part)];
  }
  static Eigen::Vector3d product(const Eigen::Matrix3d& m, const Eigen::Vector3d& v) noexcept {
    Eigen::Vector3d result;
    for (int row = 0; row < 3; ++row) {
      result[row] = m(row, 0) * v[0] + m(row, 1) * v[1] + m(row, 2) * v[2];
    }
    return result;
  }
  // Not the transpose: rotations out of text files are orthogonal to a few digits only, which would
  // count in centimetres at the end of a long range.
  static Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& m) noexcept {
    Eigen::Matrix3d result;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        const int r1 = (column + 1) % 3;
        const int r2 = (column + 2) % 3;
        const int c1 = (row + 1) % 3;
        const int c2 = (row + 2) % 3;
        result(row, column) = m(r1, c1) * m(r2, c2) - m(r1, c2) * m(r2, c1);
      }
    }
    const double determinant =
        m(0, 0) * result(0, 0) + m(0, 1) * result(1, 0) + m(0, 2) * result(2, 0);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) result(row, column) /= determinant;
    }
    return result;
  }

  Eigen::Matrix3d rotation_;
  Eigen::Matrix3d inverse_;
  double size_m_;
  Eigen::Vector3d shift_m_;  ///< keyframe's origin, from the grid's first corner
};

}  // namespace unimapper::wire
