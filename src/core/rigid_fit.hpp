// Rigid transforms from matched points (paper section V-B, the SVD of matched vertices).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "unimapper/core/pose.hpp"

namespace unimapper {

/// A point seen from two frames.
struct PointPair {
  Eigen::Vector3d a;  ///< in frame a
  Eigen::Vector3d b;  ///< in frame b
};

/// The least-squares T_b_a with `b = T_b_a * a` over all pairs. Always a proper rotation: where
/// the unconstrained optimum would be a reflection, the weakest direction is turned over. Planar
/// sets are fine; false if there are fewer than three pairs or all lie on one line.
/// Cost: linear in pairs plus one 3x3 eigen decomposition.
[[nodiscard]] bool fit_rigid(std::span<const PointPair> pairs, Pose& T_b_a) noexcept;

/// A turn about the vertical and a shift within the level plane: what two levelled frames
/// differ by, height aside.
struct PlanarPose {
  float cosine = 1.0F;  ///< of the turn
  float sine = 0.0F;    ///< of the turn
  float x = 0.0F;       ///< shift, metres
  float y = 0.0F;       ///< shift, metres

  [[nodiscard]] Eigen::Vector2f operator*(const Eigen::Vector2f& p) const noexcept {
    return {cosine * p.x() - sine * p.y() + x, sine * p.x() + cosine * p.y() + y};
  }
  [[nodiscard]] PlanarPose operator*(const PlanarPose& b) const noexcept {
    return {cosine * b.cosine - sine * b.sine, sine * b.cosine + cosine * b.sine,
            cosine * b.x - sine * b.y + x, sine * b.x + cosine * b.y + y};
  }
};

/// The turn about the vertical and the level shift of a nearly level pose.
[[nodiscard]] PlanarPose seen_from_above(const Pose& pose) noexcept;

/// The least-squares `b = T_b_a * a` over `count` pairs; false if the points coincide.
[[nodiscard]] bool fit_planar(const Eigen::Vector2f* a, const Eigen::Vector2f* b,
                              std::uint32_t count, PlanarPose& T_b_a) noexcept;

}  // namespace unimapper
