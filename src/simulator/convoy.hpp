// Convoy of three vehicles: one ahead of the robot's, the robot's, one behind.
#pragma once

#include <array>

#include "robot_motion.hpp"

namespace unimapper::simulator {

/// Vehicle 0 is the robot, 1 drives before it, 2 behind it, all on the robot's path. Their
/// motion is fixed; all other actors give way.
class Convoy {
 public:
  /// The gaps in seconds come on top of `standstill_m` metres between the middles of vehicles.
  Convoy(const RobotMotion& robot, double gap_ahead_s, double gap_behind_s, double phase,
         double standstill_m = 0.0)
      : robot_(robot),
        gap_s_{0.0, gap_ahead_s, -gap_behind_s},
        gap_m_{0.0, standstill_m, -standstill_m},
        phase_(phase) {}

  static constexpr int kVehicles = 3;
  [[nodiscard]] double travelled(int vehicle, double time_s) const;
  [[nodiscard]] Vec2 position(int vehicle, double time_s) const;
  [[nodiscard]] Vec2 heading(int vehicle, double time_s) const;
  [[nodiscard]] const Path& path() const { return robot_.path(); }

  /// True if any of the three is within `radius` of `p` at some time in [from_s, to_s].
  [[nodiscard]] bool passes(Vec2 p, double radius, double from_s, double to_s) const;
  /// True if a disc at `p` touches one of the three bodies.
  [[nodiscard]] bool touches(Vec2 p, double radius, double time_s) const;

 private:
  const RobotMotion& robot_;
  std::array<double, kVehicles> gap_s_;
  std::array<double, kVehicles> gap_m_;
  double phase_;
};

}  // namespace unimapper::simulator
