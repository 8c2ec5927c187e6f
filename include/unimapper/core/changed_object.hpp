// Changed objects: kinds of changes, and boxes.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "unimapper/core/pose.hpp"

namespace unimapper {

/// What became of an object between two sessions.
enum class ChangeKind : std::uint8_t { kAppeared, kGone, kMoved };

inline constexpr ChangeKind kChangeKinds[] = {ChangeKind::kAppeared, ChangeKind::kGone,
                                              ChangeKind::kMoved};

/// "appeared", "gone" or "moved": the word in files.
[[nodiscard]] constexpr const char* kind_name(ChangeKind kind) noexcept {
  switch (kind) {
    case ChangeKind::kAppeared:
      return "appeared";
    case ChangeKind::kGone:
      return "gone";
    case ChangeKind::kMoved:
      break;
  }
  return "moved";
}

/// A box that stands upright: two of its sides are horizontal.
struct UprightBox {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< metres
  double yaw_rad = 0.0;                              ///< of its first axis about z
  Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< along its own axes, metres

  /// From the box's own frame, with its origin at the centre, to the frame the box is given in.
  [[nodiscard]] Pose pose() const {
    const double c = std::cos(yaw_rad);
    const double s = std::sin(yaw_rad);
    Pose pose;
    pose.rotation << c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0;
    pose.translation = centre;
    return pose;
  }
  /// `point` relative to the centre, along the axes of the box, metres.
  [[nodiscard]] Eigen::Vector3d in_box(const Eigen::Vector3d& point) const {
    return pose().inverse() * point;
  }
  /// Whether `point` lies in the box or above or below it, or at most `margin_m` beside it.
  [[nodiscard]] bool covers(const Eigen::Vector3d& point, double margin_m = 0.0) const {
    const Eigen::Array2d beside =
        in_box(point).head<2>().array().abs() - 0.5 * size.head<2>().array();
    return (beside <= margin_m).all();
  }
  /// Whether `point` lies in the box, or at most `margin_m` outside a side of it.
  [[nodiscard]] bool contains(const Eigen::Vector3d& point, double margin_m = 0.0) const {
    return (in_box(point).array().abs() <= 0.5 * size.array() + margin_m).all();
  }
};

}  // namespace unimapper
