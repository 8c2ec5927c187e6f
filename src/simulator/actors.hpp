// Moving actors: poses, limb animation and labels over time.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "path.hpp"
#include "raycast.hpp"
#include "scene.hpp"
#include "terrain.hpp"
#include "world.hpp"

namespace unimapper::simulator {

/// Shape of an actor, which also selects how it moves along its path.
enum class ActorKind : std::uint8_t { kCar, kVan, kBus, kCyclist, kPerson };

struct Actor {
  ActorKind kind = ActorKind::kCar;
  std::uint32_t variant = 0;
  double scale = 1.0;
  const Path* path = nullptr;
  double lateral = 0.0;          ///< metres to the left of the path
  std::vector<float> travelled;  ///< arc length at every tick
  std::vector<float> sidestep;   ///< metres further to the left at every tick; empty: none
  std::vector<bool> moved;       ///< faster than 0.2 m/s within three seconds, at every tick
  std::uint16_t object = 0;
  bool crosses_streets = false;  ///< a person that also walks across the road
};

/// Simulated actors and the paths that belong to them; a robot's own path stays with the robot.
struct ActorSet {
  std::deque<Path> paths;
  std::vector<Actor> actors;
};

class Actors {
 public:
  /// Numbers the actors and marks when they move. `prototypes` and `terrain` must outlive this.
  Actors(const Prototypes& prototypes, const Terrain& terrain, ActorSet set);

  /// Instances near `around` during the sweep [begin_s, end_s], with its label.
  [[nodiscard]] std::vector<MovingInstance> during(double begin_s, double end_s, Vec2 around) const;

  /// When each actor is faster than 0.2 m/s, for scans that end at `stamps_s`.
  [[nodiscard]] std::vector<ObjectMotion> motions(const std::vector<double>& stamps_s) const;

  [[nodiscard]] const std::vector<Actor>& actors() const { return set_.actors; }

  static constexpr double kTick = 0.05;
  /// The simulation starts this long before time zero.
  static constexpr double kWarmUp = 8.0;
  /// Time (s) of a tick of the simulation.
  static constexpr double time_of(std::size_t tick) {
    return kTick * static_cast<double>(tick) - kWarmUp;
  }

 private:
  [[nodiscard]] double travelled(const Actor& actor, double time_s) const;
  [[nodiscard]] Frame frame_of(const Actor& actor, double time_s) const;
  void add_person_parts(const Actor& actor, double begin_s, double end_s, std::uint16_t label,
                        std::vector<MovingInstance>& instances) const;

  const Prototypes& prototypes_;
  const Terrain& terrain_;
  ActorSet set_;
};

}  // namespace unimapper::simulator
