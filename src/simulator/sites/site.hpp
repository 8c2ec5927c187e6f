// Scenes of one purpose each: a closed tour, static geometry, a robot that drives or walks.
#pragma once

#include <array>
#include <vector>

#include "src/simulator/actors.hpp"
#include "src/simulator/random.hpp"
#include "src/simulator/scene.hpp"

namespace unimapper::simulator::sites {

/// The robot's size and gait.
struct RobotStyle {
  double speed_m_s = 1.2;
  double acceleration = 1.0;
  double sensor_height_m = 1.0;
  double wobble_deg = 0.4;  ///< roll and pitch of the body at full speed
  double wobble_hz = 1.7;
  double stop_every_s = 40.0;  ///< mean time between stops of 3 to 8 s; 0: none
};

/// A point that the robot passes at some time, where an actor waits for it.
struct Spot {
  Vec2 from, to;   ///< the actor's way
  Vec2 seen_from;  ///< point of the tour from which it is seen best
};

/// Level ground, or two levels with a ramp between them along x; the robot's tour; ways of actors.
struct Plan : Terrain {
  double rise_m = 0.0, ramp_from = -1.0, ramp_to = 1.0;
  std::vector<Path> tours;         ///< A, B, C
  std::array<double, 3> starts{};  ///< arc length at time zero
  RobotStyle robot;
  std::vector<Path> walks;  ///< closed ways of walkers
  std::vector<Path> lanes;  ///< closed ways of vehicles
  std::vector<Spot> spots;

  [[nodiscard]] double height(Vec2 at) const override;
  [[nodiscard]] double walking_height(Vec2 at) const override { return height(at); }
  [[nodiscard]] Vec3 up(Vec2 at) const override;
  [[nodiscard]] Vec3 ground(Vec2 at, double lift = 0.0) const {
    return {at.x, at.y, height(at) + lift};
  }
  /// A runs along `loop`, B starts elsewhere on it, C runs the other way.
  void set_tours(const Path& loop, double start_a, double start_b, double start_c);
};

struct Site : World {
  Plan plan;

  /// Horizontal at `lift` above the ground, which it follows.
  void sheet(Vec2 low, Vec2 high, double lift, Surface surface);
  /// Between two corners of the plan, from `low_lift` to `high_lift` above the ground.
  void block(Vec2 low, Vec2 high, double low_lift, double high_lift, Surface surface);
  /// Places a prototype upright on the ground.
  void place(PrototypeRange range, std::uint32_t variant, Vec2 at, double turn,
             std::uint16_t label = 0, std::uint16_t object = 0, double scale = 1.0);
};

/// A robot on one of the plan's tours.
class Robot {
 public:
  /// Covers times from -`kLead` to `duration_s` + `kLead`.
  static constexpr double kLead = 14.0;

  Robot(const Plan& plan, char route, std::uint64_t key, double duration_s);

  /// T_world_sensor of a level sensor.
  [[nodiscard]] Frame sensor_frame(double time_s) const;
  [[nodiscard]] const Path& path() const { return path_; }
  /// Arc length on the path.
  [[nodiscard]] double travelled(double time_s) const;
  [[nodiscard]] double speed(double time_s) const;
  [[nodiscard]] Vec2 at(double time_s) const { return path_.at(travelled(time_s)); }
  /// First time after the start at which the robot is nearest to `point`; negative if it never
  /// comes within `reach` metres.
  [[nodiscard]] double passes(Vec2 point, double reach) const;

 private:
  const Plan& plan_;
  const Path& path_;
  double duration_s_;
  std::vector<double> travelled_;  // every tick
  std::array<double, 2> phases_{};
};

/// Ticks of the actors of a visit.
std::size_t tick_count(double duration_s);

}  // namespace unimapper::simulator::sites
