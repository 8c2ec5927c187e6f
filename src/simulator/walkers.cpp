// Pedestrians of the town: groups of one to four on the sidewalks.
#include <algorithm>

#include "random.hpp"
#include "traffic.hpp"

namespace unimapper::simulator {

void Traffic::add_group(const Path& path, double speed, Random& random) {
  const bool crosses = speed > 0.0;
  const bool stands = !crosses && random.chance(0.12);
  const bool pauses = !crosses && random.chance(0.3);
  const double cruise = crosses ? speed : random.uniform(0.9, 1.6);
  const std::uint32_t size = random.chance(0.5) ? 1 : 2 + random.index(3);
  std::vector<float> travelled;
  double s = random.uniform(0.0, path.length());
  double now = stands ? 0.0 : cruise;
  double pause_left = 0.0;
  for (std::size_t tick = 0; tick < ticks_; ++tick) {
    travelled.push_back(static_cast<float>(s));
    if (pauses && pause_left <= 0.0 && random.chance(Actors::kTick / 25.0)) {
      pause_left = random.uniform(4.0, 15.0);
    }
    pause_left -= Actors::kTick;
    const double wish = stands || pause_left > 0.0 ? 0.0 : cruise;
    now += std::clamp(wish - now, -1.5 * Actors::kTick, 1.5 * Actors::kTick);
    s += now * Actors::kTick;
  }
  for (std::uint32_t member = 0; member < size; ++member) {
    Actor actor;
    actor.kind = ActorKind::kPerson;
    actor.variant = random.index(12);
    actor.scale = random.chance(0.12) ? random.uniform(0.62, 0.8) : random.uniform(0.93, 1.07);
    actor.path = &path;
    actor.crosses_streets = crosses;
    actor.lateral = size > 1 ? (member % 2 == 0 ? 0.33 : -0.33) : 0.0;
    actor.travelled = travelled;
    const auto behind = static_cast<float>(0.85 * (member / 2) + random.uniform(0.0, 0.25));
    for (float& value : actor.travelled) value -= behind;
    actors_.push_back(std::move(actor));
  }
}

void Traffic::add_persons(std::uint64_t seed, std::uint32_t day) {
  for (int column = 0; column < TownPlan::kBlocks; ++column) {
    for (int row = 0; row < TownPlan::kBlocks; ++row) {
      Random random(seed, Stream::kPedestrian, day, static_cast<std::uint64_t>(column * 16 + row));
      const std::uint32_t groups = 2 + random.index(4);
      for (std::uint32_t g = 0; g < groups; ++g) {
        const double from_centre = street::kKerb + random.uniform(1.3, 1.9);
        paths_.push_back(sidewalk_path(plan_, column, row, 1, 1, from_centre, random.chance(0.5)));
        add_group(paths_.back(), 0.0, random);
      }
      // Around two blocks: across the street between them, twice.
      if (column + 1 < TownPlan::kBlocks && row + 1 < TownPlan::kBlocks) {
        const bool wide = random.chance(0.5);
        paths_.push_back(sidewalk_path(plan_, column, row, wide ? 2 : 1, wide ? 1 : 2,
                                       street::kKerb + random.uniform(1.3, 1.9),
                                       random.chance(0.5)));
        add_group(paths_.back(), random.uniform(1.0, 1.5), random);
      }
    }
  }
}

void Traffic::remove_colliding_persons() {
  constexpr std::size_t kEvery = 4;  // ticks
  const auto is_hit = [&](const Actor& actor) {
    if (actor.kind != ActorKind::kPerson || !actor.crosses_streets) return false;
    for (std::size_t tick = 0; tick < ticks_; tick += kEvery) {
      const Vec2 here = actor.path->at(actor.travelled[tick]);
      if (convoy_.touches(here, 0.9, Actors::time_of(tick))) return true;
    }
    return false;
  };
  std::erase_if(actors_, is_hit);
}

}  // namespace unimapper::simulator
