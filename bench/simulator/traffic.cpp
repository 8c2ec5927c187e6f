#include "traffic.hpp"

#include <algorithm>

#include "random.hpp"

namespace unimapper::simulator {
namespace {

double time_of(std::size_t tick) {
  return Actors::kTick * static_cast<double>(tick) - Actors::kWarmUp;
}

}  // namespace

Traffic::Traffic(const TownPlan& plan, const RobotMotion& robot, std::uint64_t seed,
                 std::uint32_t day, double duration_s)
    : plan_(plan),
      robot_(robot),
      ticks_(static_cast<std::size_t>((duration_s + 2.0 * Actors::kWarmUp) / Actors::kTick) + 2) {
  Random random(seed, Stream::kTraffic, day);
  add_convoy(random);
  add_persons(seed, day);
}

/// A vehicle before and one behind the robot on the robot's own path: they sweep exactly the space
/// the robot drives through, the hardest case for free-space reasoning.
void Traffic::add_convoy(Random& random) {
  for (const double side : {1.0, -1.0}) {
    Actor actor;
    actor.kind = ActorKind::kCar;
    actor.variant = random.index(9);
    actor.path = &robot_.path();
    const double gap_s = random.uniform(2.4, 3.2);
    const double phase = random.uniform(0.0, 2.0 * kPi);
    for (std::size_t tick = 0; tick < ticks_; ++tick) {
      const double t = time_of(tick);
      const double ahead = side * (gap_s + 0.5 * std::sin(0.21 * t + phase));
      actor.travelled.push_back(static_cast<float>(robot_.travelled(t + ahead)));
    }
    actors_.push_back(std::move(actor));
  }
}

/// Groups of one to four on the sidewalks; some stand, some stop now and then.
void Traffic::add_persons(std::uint64_t seed, std::uint32_t day) {
  for (int column = 0; column < TownPlan::kBlocks; ++column) {
    for (int row = 0; row < TownPlan::kBlocks; ++row) {
      Random random(seed, Stream::kPedestrian, day, static_cast<std::uint64_t>(column * 16 + row));
      const std::uint32_t groups = 2 + random.index(4);
      for (std::uint32_t g = 0; g < groups; ++g) {
        const double from_centre = street::kKerb + random.uniform(1.3, 1.9);
        paths_.push_back(sidewalk_path(plan_, column, row, from_centre, random.chance(0.5)));
        const Path& path = paths_.back();
        const double start = random.uniform(0.0, path.length());
        const bool stands = random.chance(0.1);
        const bool pauses = random.chance(0.3);
        const double speed = random.uniform(0.9, 1.6);
        const std::uint32_t size = random.chance(0.5) ? 1 : 2 + random.index(3);
        std::vector<float> travelled;
        double s = start;
        double now = 0.0;
        double pause_left = 0.0;
        for (std::size_t tick = 0; tick < ticks_; ++tick) {
          travelled.push_back(static_cast<float>(s));
          if (pauses && pause_left <= 0.0 && random.chance(Actors::kTick / 25.0)) {
            pause_left = random.uniform(4.0, 15.0);
          }
          pause_left -= Actors::kTick;
          const double wish = stands || pause_left > 0.0 ? 0.0 : speed;
          now += std::clamp(wish - now, -1.5 * Actors::kTick, 1.5 * Actors::kTick);
          s += now * Actors::kTick;
        }
        for (std::uint32_t member = 0; member < size; ++member) {
          Actor actor;
          actor.kind = ActorKind::kPerson;
          actor.variant = random.index(12);
          actor.scale =
              random.chance(0.12) ? random.uniform(0.62, 0.8) : random.uniform(0.93, 1.07);
          actor.path = &path;
          actor.lateral = 0.65 * (member % 2 == 0 ? 0.5 : -0.5) * (size > 1 ? 1.0 : 0.0);
          actor.travelled = travelled;
          const auto behind = static_cast<float>(0.8 * (member / 2) + random.uniform(0.0, 0.25));
          for (float& value : actor.travelled) value -= behind;
          actors_.push_back(std::move(actor));
        }
      }
    }
  }
}

}  // namespace unimapper::simulator
