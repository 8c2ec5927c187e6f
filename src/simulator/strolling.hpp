// Pedestrian, cyclist and van motion along closed paths with collision avoidance.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "actors.hpp"

namespace unimapper::simulator {

class Random;

inline constexpr double kPersonRadius = 0.3;
inline constexpr double kAbreast = 0.62;  ///< metres between persons side by side

/// A group of persons, a cyclist or a van: one body on a closed path.
struct Stroller {
  ActorKind kind = ActorKind::kPerson;
  const Path* path = nullptr;
  std::uint32_t size = 1;
  double cruise = 1.2;
  double home = 0.0;        ///< metres left of the path
  double room = 0.8;        ///< how far it may step aside
  double departs_s = -1e9;  ///< stands until then
  double pauses_per_s = 0.0;
  double radius = kPersonRadius;
  double half_length = 0.0;
  double at = 0.0, speed = 0.0, side = 0.0;
  double pause_until_s = -1e9;
  double blocked_s = 0.0;  ///< duration of the current obstruction
  std::vector<float> travelled, sidestep;
};

/// Everybody walks around everybody else, all actors that `crowd` holds already, and the robot.
class Strolling {
 public:
  /// `robot_at` says where the robot is at a time in seconds; all references must outlive this.
  Strolling(std::function<Vec2(double)> robot_at, std::size_t ticks, Random& random,
            ActorSet& crowd)
      : robot_at_(std::move(robot_at)), ticks_(ticks), random_(random), crowd_(crowd) {}

  void add(Stroller stroller) { strollers_.push_back(std::move(stroller)); }
  /// Simulates all ticks, then makes every member of every group an actor of the crowd.
  void run();

 private:
  struct Body;
  struct Steering;
  [[nodiscard]] std::vector<Body> bodies_at(std::size_t tick) const;
  [[nodiscard]] Steering steer(std::size_t self, const std::vector<Body>& bodies) const;
  void step(Stroller& stroller, const Steering& steering, double time_s);
  void make_actors();

  std::function<Vec2(double)> robot_at_;
  std::size_t ticks_;
  Random& random_;
  ActorSet& crowd_;
  std::vector<Stroller> strollers_;
};

/// A person of random shape and size on `path`.
Actor make_person(const Path& path, Random& random);
/// Where an actor is at a tick.
Vec2 position(const Actor& actor, std::size_t tick);
/// A robot's trajectory is fixed, so actors that collide with it are removed altogether.
void remove_colliding_actors(const std::function<Vec2(double)>& robot_at, std::size_t ticks,
                             ActorSet& crowd);

}  // namespace unimapper::simulator
