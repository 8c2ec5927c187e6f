// Results in words: numbers with so many digits that rounding errors do not show
#pragma once

#include <type_traits>

#include "tests/test.hpp"
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

/// Whole numbers, each behind a blank.
template <typename Range>
std::string list_text(const Range& numbers) {
  std::string text;
  for (const auto number : numbers) text += " " + count(number);
  return text;
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
  return "up " + rough(up.variance_x) + " " + rough(up.covariance_xy) + " " + rough(up.variance_y);
}

inline std::string hexadecimal(std::uint64_t value) {
  char text[32];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

/// FNV-1a over bytes.
inline std::string checksum(std::span<const std::uint8_t> bytes) {
  std::uint64_t state = 0xCBF29CE484222325ULL;
  for (const std::uint8_t byte : bytes) state = (state ^ byte) * 0x100000001B3ULL;
  return hexadecimal(state);
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
    return count(count_) + " at " + vector_text(mean, digits) + " spread " +
           vector_text(spread.diagonal(), digits) + " products " +
           vector_text(Eigen::Vector3d(spread(0, 1), spread(0, 2), spread(1, 2)), digits);
  }

 private:
  std::uint64_t count_ = 0;
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second_ = Eigen::Matrix3d::Zero();
};

/// A word, a whole number, a number with three decimals, a pose or the moments of a cloud.
template <typename Value>
std::string word(const Value& value) {
  if constexpr (std::is_integral_v<Value>) {
    return count(value);
  } else if constexpr (std::is_floating_point_v<Value>) {
    return fixed(static_cast<double>(value), 3);
  } else if constexpr (std::is_same_v<Value, Pose>) {
    return pose_text(value);
  } else if constexpr (std::is_same_v<Value, CloudMoments>) {
    return value.text();
  } else {
    return std::string(value);
  }
}

/// Words with blanks between them.
template <typename... Values>
std::string join(const Values&... values) {
  std::string text;
  ((text += (text.empty() ? "" : " ") + word(values)), ...);
  return text;
}

/// The same as a line.
template <typename... Values>
std::string line_of(const Values&... values) {
  return join(values...) + "\n";
}

inline std::string cells_text(std::span<const FineCell> cells) {
  CloudMoments moments;
  std::uint64_t points = 0;
  std::uint64_t ground = 0;
  for (const FineCell& cell : cells) {
    moments.add(cell.position);
    points += cell.points;
    ground += cell.ground;
  }
  return join(moments, "points", points, "ground", ground);
}

inline std::string keypoints_text(std::span<const Keypoint> keypoints) {
  CloudMoments positions;
  CloudMoments normals;
  std::uint64_t strength = 0;
  std::uint64_t columns = 0;
  for (const Keypoint& keypoint : keypoints) {
    positions.add(keypoint.position);
    normals.add(keypoint.normal);
    strength += keypoint.strength;
    columns ^= keypoint.occupancy;
  }
  return line_of("  keypoints", positions) +
         line_of("  normals", normals, "strength", strength, "columns", columns);
}

template <typename Relabelled>
std::string relabelled_text(const char* first, const Relabelled& last) {
  return line_of(first, last.sequence, "by", last.later_keyframes, "to dynamic",
                 last.cells_now_dynamic, "to static", last.cells_now_static);
}

}  // namespace unimapper::regression
