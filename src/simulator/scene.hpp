// Interface between the scanner and the scenes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "raycast.hpp"

namespace unimapper::simulator {

/// One visit to a scene: seed, day, route and duration.
struct Visit {
  std::uint64_t seed;
  std::uint32_t day;
  char route;  ///< 'A', 'B' or 'C'
  double duration_s;
};

/// Scans during which an object moves, first and last included.
struct ObjectMotion {
  std::uint16_t object;
  std::uint32_t first_scan, last_scan;
};

class Scene {
 public:
  Scene() = default;
  virtual ~Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// Static geometry.
  [[nodiscard]] virtual const World& world() const = 0;
  /// T_world_sensor of a sensor that is mounted level, at any time of the visit; thread safe.
  [[nodiscard]] virtual Frame sensor_frame(double time_s) const = 0;
  /// Moving instances near `around` during the sweep [begin_s, end_s]; thread safe.
  [[nodiscard]] virtual std::vector<MovingInstance> during(double begin_s, double end_s,
                                                           Vec2 around) const = 0;
  /// When each object moves, for scans that end at `stamps_s`; ordered by object and scan.
  [[nodiscard]] virtual std::vector<ObjectMotion> motions(
      const std::vector<double>& stamps_s) const = 0;
};

/// Names of all scenes, comma separated.
std::string scene_names();
bool is_scene(std::string_view name);
/// The scene called `name`, which must be one.
std::unique_ptr<Scene> make_scene(std::string_view name, const Visit& visit);

std::unique_ptr<Scene> make_town_scene(const Visit& visit);
std::unique_ptr<Scene> make_campus_scene(const Visit& visit);
std::unique_ptr<Scene> make_deck_scene(const Visit& visit);
std::unique_ptr<Scene> make_square_scene(const Visit& visit);
std::unique_ptr<Scene> make_convoy_scene(const Visit& visit);
std::unique_ptr<Scene> make_street_scene(const Visit& visit);
std::unique_ptr<Scene> make_tunnel_scene(const Visit& visit);
std::unique_ptr<Scene> make_hall_scene(const Visit& visit);
// Places of which there are two that look alike: A and B visit one of them, C the other.
std::unique_ptr<Scene> make_bore_scene(const Visit& visit);
std::unique_ptr<Scene> make_fixtures_scene(const Visit& visit);
std::unique_ptr<Scene> make_decks_scene(const Visit& visit);
std::unique_ptr<Scene> make_streets_scene(const Visit& visit);
std::unique_ptr<Scene> make_corridor_scene(const Visit& visit);
std::unique_ptr<Scene> make_courtyard_scene(const Visit& visit);
// The same, but the other one lacks what tells places of the first apart.
std::unique_ptr<Scene> make_quad_scene(const Visit& visit);
std::unique_ptr<Scene> make_orchard_scene(const Visit& visit);

}  // namespace unimapper::simulator
