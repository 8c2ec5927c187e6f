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

  RobotMotion(const TownPlan& plan, char route, std::uint64_t seed, double duration_s);

  /// T_town_sensor, roll, pitch and body vibration included.
  [[nodiscard]] Frame sensor_frame(double time_s) const;
  [[nodiscard]] const Path& path() const { return path_; }
  /// Arc length on the path.
  [[nodiscard]] double travelled(double time_s) const;
  [[nodiscard]] double speed(double time_s) const;

 private:
  const TownPlan& plan_;
  Path path_;
  std::vector<double> travelled_;  // every kTick
  double phases_[6] = {};
};

}  // namespace unimapper::simulator
