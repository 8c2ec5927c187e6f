#include "src/core/known_mistake.hpp"

namespace unimapper {
namespace {

/// Quaternion read as (x, y, z, w) from columns in another order.
Pose with_quaternion(const Pose& pose, bool w_was_first) noexcept {
  const Eigen::Quaterniond q = pose.quaternion();
  return {w_was_first ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w())
                      : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()),
          pose.translation};
}

Eigen::Matrix3d matrix(const std::array<std::int8_t, 9>& rows) noexcept {
  Eigen::Matrix3d m;
  for (int i = 0; i < 9; ++i) {
    m(i / 3, i % 3) = static_cast<double>(rows[static_cast<std::size_t>(i)]);
  }
  return m;
}

}  // namespace

double metres_of(KnownMistake mistake) noexcept {
  constexpr std::array<double, 8> kMetres = {1e-3, 1e-2, 1e3, 0.3048, 1e-1, 1e2, 1e1, 1.0 / 0.3048};
  const auto id = static_cast<std::uint8_t>(mistake);
  return id >= kFirstScale && id < kKnownMistakes ? kMetres[id - kFirstScale] : 1.0;
}

Eigen::Matrix3d axes_of(KnownMistake mistake) noexcept {
  switch (mistake) {
    case KnownMistake::kCameraAxes:
      return matrix({0, -1, 0, 0, 0, -1, 1, 0, 0});
    case KnownMistake::kZDown:
      return matrix({1, 0, 0, 0, -1, 0, 0, 0, -1});
    case KnownMistake::kLeftHanded:
      return matrix({1, 0, 0, 0, -1, 0, 0, 0, 1});
    case KnownMistake::kMirroredX:
      return matrix({-1, 0, 0, 0, 1, 0, 0, 0, 1});
    case KnownMistake::kMirroredZ:
      return matrix({1, 0, 0, 0, 1, 0, 0, 0, -1});
    case KnownMistake::kYaw180:
      return matrix({-1, 0, 0, 0, -1, 0, 0, 0, 1});
    case KnownMistake::kYaw90:
      return matrix({0, 1, 0, -1, 0, 0, 0, 0, 1});
    case KnownMistake::kYawMinus90:
      return matrix({0, -1, 0, 1, 0, 0, 0, 0, 1});
    default:
      return Eigen::Matrix3d::Identity();
  }
}

Pose correct(KnownMistake mistake, const Pose& pose) noexcept {
  switch (mistake) {
    case KnownMistake::kInverted:
      return pose.inverse();
    case KnownMistake::kWFirst:
    case KnownMistake::kWLast:
      return with_quaternion(pose, mistake == KnownMistake::kWFirst);
    case KnownMistake::kTransposed:
      return {pose.rotation.transpose(), pose.translation};
    default:
      return {pose.rotation * axes_of(mistake), metres_of(mistake) * pose.translation};
  }
}

}  // namespace unimapper
