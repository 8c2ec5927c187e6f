#include "crowd.hpp"

#include <algorithm>

#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
bool is_clear_on_plaza(const Plan& plan, Vec2 at, double radius) {
  if (!plan.plaza().contains(at, -radius) || plan.queue().contains(at, radius)) return false;
  const auto fixtures = plan.fixtures();
  return std::all_of(fixtures.begin(), fixtures.end(), [&](const Fixture& fixture) {
    return norm(fixture.at - at) > fixture.radius + radius;
  });
}

ActorSet simulate_crowd(const Plan& plan, const RobotWalk& robot, std::uint64_t seed,
                        std::uint32_t day, double duration_s) {
  const auto ticks =
      static_cast<std::size_t>((duration_s + 2.0 * Actors::kWarmUp) / Actors::kTick) + 2;
  ActorSet crowd;
  const auto random = [&](std::uint64_t part) {
    return Random(seed, Stream::kPedestrian, day, part);
  };
  Random companions = random(1);
  add_companions(robot, ticks, companions, crowd);
  Random queue = random(2);
  add_queue(plan, ticks, queue, crowd);
  Random gatherings = random(3);
  add_gatherings(plan, ticks, gatherings, crowd);
  Random strollers = random(4);
  add_strollers(plan, robot, ticks, strollers, crowd);
  remove_colliding_actors([&](double time_s) { return robot.at(time_s); }, ticks, crowd);
  return crowd;
}

}  // namespace unimapper::simulator::campus
