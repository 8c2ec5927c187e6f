// Rays against what stands in a simulated world.
#pragma once

#include "src/simulator/raycast.hpp"
#include "tests/test.hpp"

namespace unimapper::simulator::test {

/// A world to cast rays into; everything that moves is left out.
class Standing {
 public:
  explicit Standing(const World& world)
      : scene_(world), nothing_(scene_), caster_(scene_, nothing_) {}

  /// First surface on each way between two points; the distance is negative where there is none.
  [[nodiscard]] std::vector<RayHit> between(const std::vector<std::pair<Vec3, Vec3>>& ways) const {
    std::vector<RayQuery> queries;
    for (const auto& [from, to] : ways) {
      const double length = norm(to - from);
      queries.push_back({from, normalized(to - from), 0.0F, 0.0F, static_cast<float>(length)});
    }
    std::vector<RayHit> hits(queries.size());
    caster_.cast(queries, hits);
    return hits;
  }
  /// First surface in a direction.
  [[nodiscard]] RayHit towards(Vec3 from, Vec3 direction, double reach_m = 100.0) const {
    return between({{from, from + reach_m * normalized(direction)}}).front();
  }

 private:
  StaticScene scene_;
  MovingScene nothing_;
  Caster caster_;
};

}  // namespace unimapper::simulator::test
