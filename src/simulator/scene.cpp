#include "scene.hpp"

#include <algorithm>
#include <iterator>

namespace unimapper::simulator {
namespace {

struct Entry {
  std::string_view name;
  std::unique_ptr<Scene> (*make)(const Visit& visit);
};

constexpr Entry kScenes[] = {{"town", make_town_scene},         {"campus", make_campus_scene},
                             {"deck", make_deck_scene},         {"square", make_square_scene},
                             {"convoy", make_convoy_scene},     {"street", make_street_scene},
                             {"tunnel", make_tunnel_scene},     {"hall", make_hall_scene},
                             {"bore", make_bore_scene},         {"fixtures", make_fixtures_scene},
                             {"decks", make_decks_scene},       {"streets", make_streets_scene},
                             {"corridor", make_corridor_scene}, {"courtyard", make_courtyard_scene},
                             {"quad", make_quad_scene},         {"orchard", make_orchard_scene}};

const Entry* find_scene(std::string_view name) {
  const auto* found = std::find_if(std::begin(kScenes), std::end(kScenes),
                                   [&](const Entry& entry) { return entry.name == name; });
  return found == std::end(kScenes) ? nullptr : found;
}

}  // namespace

std::string scene_names() {
  std::string names;
  for (const Entry& entry : kScenes) {
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  return names;
}

bool is_scene(std::string_view name) { return find_scene(name) != nullptr; }

std::unique_ptr<Scene> make_scene(std::string_view name, const Visit& visit) {
  return find_scene(name)->make(visit);
}

}  // namespace unimapper::simulator
