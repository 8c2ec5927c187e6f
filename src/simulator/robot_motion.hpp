// Motion model of the robot's car along its routes through the town.
#pragma once

#include <cstdint>
#include <vector>

#include "path.hpp"

namespace unimapper::simulator {

/// The robot's own vehicle on one of the routes A, B, C. Time zero is the end of the first sweep.
class RobotMotion {
 public:
  /// Covers times from -`kLead` to `duration_s` + `kLead`.
  static constexpr double kLead = 14.0;

  /// `stops_and_goes`: stands for 3 to 20 s every few seconds of driving.
  RobotMotion(const TownPlan& plan, char route, std::uint64_t seed, double duration_s,
              bool stops_and_goes = false);

  [[nodiscard]] bool stops_and_goes() const { return stops_and_goes_; }

  /// T_town_sensor, roll, pitch and body vibration included.
  [[nodiscard]] Frame sensor_frame(double time_s) const;
  [[nodiscard]] const Path& path() const { return path_; }
  /// Arc length on the path.
  [[nodiscard]] double travelled(double time_s) const;
  [[nodiscard]] double speed(double time_s) const;

 private:
  const TownPlan& plan_;
  Path path_;
  bool stops_and_goes_;
  std::vector<double> travelled_;  // every kTick
  double phases_[6] = {};
};

/// The robot's own vehicle in stop-and-go traffic.
class StopAndGoMotion : public RobotMotion {
 public:
  StopAndGoMotion(const TownPlan& plan, char route, std::uint64_t seed, double duration_s)
      : RobotMotion(plan, route, seed, duration_s, true) {}
};

}  // namespace unimapper::simulator
