#include "src/input/extrinsic.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "src/input/text.hpp"

namespace unimapper::input {

Pose extrinsic_pose(const std::array<double, 6>& values) {
  const auto turn = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees / kDegreesPerRadian, axis);
  };
  return {Eigen::Quaterniond(turn(values[5], Eigen::Vector3d::UnitZ()) *
                             turn(values[4], Eigen::Vector3d::UnitY()) *
                             turn(values[3], Eigen::Vector3d::UnitX())),
          {values[0], values[1], values[2]}};
}

Pose parse_extrinsic(const std::string& text, const std::string& option) {
  std::array<double, 6> values{};
  const char* next = text.data();
  const char* const end = text.data() + text.size();
  bool is_whole = true;
  for (std::size_t i = 0; i < values.size() && is_whole; ++i) {
    const auto [stopped, error] = std::from_chars(next, end, values[i]);
    const bool is_last = i + 1 == values.size();
    is_whole = error == std::errc{} && std::isfinite(values[i]) &&
               (is_last ? stopped == end : stopped != end && *stopped == ',');
    next = is_last ? stopped : stopped + 1;
  }
  if (!is_whole) {
    throw std::runtime_error(option + ": '" + text +
                             "' is not of the form x,y,z,roll,pitch,yaw (metres, degrees)");
  }
  return extrinsic_pose(values);
}

std::string extrinsic_text(const Pose& pose) {
  const Eigen::Matrix3d& r = pose.rotation;
  const auto plain = [](double value) { return std::fabs(value) < 5e-3 ? 0.0 : value; };
  return text("%.2f,%.2f,%.2f,%.2f,%.2f,%.2f", plain(pose.translation.x()),
              plain(pose.translation.y()), plain(pose.translation.z()),
              plain(kDegreesPerRadian * std::atan2(r(2, 1), r(2, 2))),
              plain(kDegreesPerRadian * std::asin(std::clamp(-r(2, 0), -1.0, 1.0))),
              plain(kDegreesPerRadian * std::atan2(r(1, 0), r(0, 0))));
}

}  // namespace unimapper::input
