#include "robot_walk.hpp"

#include <algorithm>

#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

constexpr double kTick = 0.05;

/// Metres from the first corner of the plaza to where a recording starts; C runs the other way.
double start_of(char route) {
  if (route == 'A') return 4.0;
  return route == 'B' ? 14.0 : 26.0;
}

/// Walking pace with slow variations, reduced in curves.
double wished_speed(const Path& path, double s, double phase) {
  const double pace = 1.2 + 0.08 * std::sin(s / 9.0 + phase);
  return std::min(pace, std::sqrt(0.5 / std::max(std::abs(path.curvature(s)), 1e-6)));
}

}  // namespace

RobotWalk::RobotWalk(const Plan& plan, char route, std::uint64_t key, double duration_s)
    : plan_(plan), path_(plan.tour(route)) {
  constexpr double kAcceleration = 0.8;
  Random random(key, Stream::kMotion, static_cast<std::uint64_t>(route));
  for (double& phase : phases_) phase = random.uniform(0.0, 2.0 * kPi);
  double s = start_of(route) - 1.2 * kLead;
  double speed = 1.2;
  double stop_at = random.uniform(15.0, 45.0);
  double go_at = stop_at + random.uniform(3.0, 8.0);
  const auto ticks = static_cast<std::size_t>((duration_s + 2.0 * kLead) / kTick) + 2;
  travelled_.reserve(ticks);
  for (std::size_t i = 0; i < ticks; ++i) {
    travelled_.push_back(s);
    const double t = kTick * static_cast<double>(i) - kLead;
    if (t > go_at) {
      stop_at = t + random.uniform(25.0, 60.0);
      go_at = stop_at + random.uniform(3.0, 8.0);
    }
    const double wish = t > stop_at ? 0.0 : wished_speed(path_, s, phases_[0]);
    speed += std::clamp(wish - speed, -kAcceleration * kTick, kAcceleration * kTick);
    s += kTick * speed;
  }
}

double RobotWalk::travelled(double time_s) const {
  return interpolate(travelled_, (time_s + kLead) / kTick);
}

double RobotWalk::speed(double time_s) const {
  return (travelled(time_s + kTick) - travelled(time_s - kTick)) / (2.0 * kTick);
}

Frame RobotWalk::sensor_frame(double time_s) const {
  const double s = travelled(time_s);
  const Vec2 at = path_.at(s);
  const Frame ground = sloped_frame(plan_.ground(at), path_.heading(s), plan_.up(at));
  // A step every half second: up and down twice, from side to side once per stride.
  constexpr double kStride = 0.95;  // Hz
  const double strength = std::clamp(speed(time_s), 0.0, 1.0);
  const auto swing = [&](int i, double hertz) {
    return std::sin(2.0 * kPi * hertz * time_s + phases_[i]);
  };
  const double roll = 1.2 * kDegree * swing(1, kStride);
  const double pitch = 0.9 * kDegree * swing(2, 2.0 * kStride);
  const double yaw = 1.5 * kDegree * (0.7 * swing(3, kStride) + 0.3 * swing(4, 0.31));
  Frame body = rotation_frame({strength * roll, strength * pitch, strength * yaw});
  body.origin = {0.0, 0.008 * strength * swing(1, kStride),
                 kSensorHeight + 0.012 * strength * swing(5, 2.0 * kStride)};
  return ground * body;
}

}  // namespace unimapper::simulator::campus
