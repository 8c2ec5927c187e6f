// Results in words: numbers with so many digits that rounding errors do not show
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::regression {

/// A number with `digits` decimals; never "-0.000".
inline std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  const std::string word = text;
  const bool zero = word.find_first_not_of("-0.") == std::string::npos;
  return zero && word[0] == '-' ? word.substr(1) : word;
}

/// A number with three significant digits; rounding errors are zero.
inline std::string rough(double value) {
  if (std::abs(value) < 1e-12) return "0";
  char text[64];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

template <typename Integer>
std::string count(Integer value) {
  return std::to_string(value);
}

/// Words with blanks between them.
template <typename... Words>
std::string join(const Words&... words) {
  std::string line;
  ((line += (line.empty() ? "" : " ") + std::string(words)), ...);
  return line;
}

template <typename Derived>
std::string vector_text(const Eigen::MatrixBase<Derived>& v, int digits = 3) {
  std::string text;
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    text += (i == 0 ? "" : " ") + fixed(static_cast<double>(v.derived().coeff(i)), digits);
  }
  return text;
}

/// Millimetres and millidegrees: "x y z | roll pitch yaw".
inline std::string pose_text(const Pose& pose, int digits = 3) {
  const Eigen::Matrix3d& r = pose.rotation;
  const Eigen::Vector3d angles(std::atan2(r(2, 1), r(2, 2)),
                               std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0))),
                               std::atan2(r(1, 0), r(0, 0)));
  return vector_text(pose.translation, digits) + " | " +
         vector_text(angles * kDegreesPerRadian, digits);
}

inline std::string up_text(const KeyframeUp& up) {
  if (!up.known) return "up unknown";
  return join("up", rough(static_cast<double>(up.variance_x)),
              rough(static_cast<double>(up.covariance_xy)),
              rough(static_cast<double>(up.variance_y)));
}

/// FNV-1a over bytes, as 16 hexadecimal digits.
inline std::string checksum(std::span<const std::uint8_t> bytes) {
  std::uint64_t state = 0xCBF29CE484222325ULL;
  for (const std::uint8_t byte : bytes) state = (state ^ byte) * 0x100000001B3ULL;
  char text[32];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(state));
  return text;
}
inline std::string checksum(const std::string& text) {
  return checksum({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// Centroid, mean square about each axis and mean products of a cloud: they change when points
/// move, appear or vanish, whatever their order.
class CloudMoments {
 public:
  void add(const Eigen::Vector3f& point) {
    const Eigen::Vector3d p = point.cast<double>();
    ++count_;
    first_ += p;
    second_ += p * p.transpose();
  }
  [[nodiscard]] std::string text(int digits = 3) const {
    if (count_ == 0) return "none";
    const double n = static_cast<double>(count_);
    const Eigen::Vector3d mean = first_ / n;
    const Eigen::Matrix3d spread = second_ / n - mean * mean.transpose();
    return join(count(count_), "at", vector_text(mean, digits), "spread",
                vector_text(spread.diagonal(), digits), "products", fixed(spread(0, 1), digits),
                fixed(spread(0, 2), digits), fixed(spread(1, 2), digits));
  }

 private:
  std::uint64_t count_ = 0;
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second_ = Eigen::Matrix3d::Zero();
};

}  // namespace unimapper::regression
