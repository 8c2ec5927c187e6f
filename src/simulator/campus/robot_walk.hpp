// Motion model of a small robot at walking pace.
#pragma once

#include <cstdint>
#include <vector>

#include "plan.hpp"

namespace unimapper::simulator::campus {

/// A small robot among pedestrians on one of the tours A, B, C: walking speed, a stop now and
/// then, and a body that bobs and sways with its gait.
class RobotWalk {
 public:
  /// Covers times from -`kLead` to `duration_s` + `kLead`.
  static constexpr double kLead = 10.0;
  static constexpr double kSensorHeight = 1.0;  ///< metres above the ground

  RobotWalk(const Plan& plan, char route, std::uint64_t key, double duration_s);

  /// T_campus_sensor, slope and gait included.
  [[nodiscard]] Frame sensor_frame(double time_s) const;
  [[nodiscard]] const Path& path() const { return path_; }
  /// Arc length on the path.
  [[nodiscard]] double travelled(double time_s) const;
  [[nodiscard]] double speed(double time_s) const;
  [[nodiscard]] Vec2 at(double time_s) const { return path_.at(travelled(time_s)); }

 private:
  const Plan& plan_;
  const Path& path_;
  std::vector<double> travelled_;  // every kTick
  double phases_[6] = {};
};

}  // namespace unimapper::simulator::campus
