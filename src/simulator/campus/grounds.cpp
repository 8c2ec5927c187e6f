// Ground surface of the campus: lawns, paths and paved areas.
#include <algorithm>

#include "campus.hpp"
#include "src/simulator/random.hpp"
#include "src/simulator/sheet.hpp"

namespace unimapper::simulator::campus {
namespace {

constexpr double kApron = 2.2;  // pavement around the halls

bool is_beside_hall(const Plan& plan, Vec2 at) {
  const auto halls = plan.halls();
  return std::any_of(halls.begin(), halls.end(),
                     [&](const Hall& hall) { return hall.area.contains(at, kApron); });
}

Surface surface_at(const Plan& plan, Vec2 at) {
  if (plan.plaza().contains(at)) return Surface::kPlaza;
  if (plan.parking().contains(at)) return Surface::kParkingLot;
  const bool is_paved = plan.to_pavement(at) < 0.0 || is_beside_hall(plan, at) ||
                        plan.stairs().contains(at, 3.0) || plan.ramps()[0].contains(at, 0.8) ||
                        plan.ramps()[1].contains(at, 0.8);
  return is_paved ? Surface::kSidewalk : Surface::kLawn;
}

/// Coarse ground beyond the finely modelled part, and a floor below it.
void add_surroundings(const Plan& plan, Mesh& mesh) {
  constexpr double kReach = 180.0;
  constexpr double kBelow = 0.25;
  const Area& fine = plan.grounds();
  const auto position_at = [&](Vec2 p) {
    const double below = fine.contains(p, -8.0) ? kBelow : 0.0;
    return Vec3{p.x, p.y, plan.hills(p) - below};
  };
  add_sheet(mesh, {fine.low.x - kReach, fine.low.y - kReach},
            {fine.high.x + kReach, fine.high.y + kReach}, 5.0, position_at,
            [](Vec2) { return Surface::kLawn; });
}

}  // namespace

void add_grounds(std::uint64_t seed, Campus& campus) {
  constexpr double kCell = 0.8;
  const Plan& plan = campus.plan;
  add_surroundings(plan, campus.mesh);
  Random random(seed, Stream::kBlock, 1);
  const auto position_at = [&](Vec2 p) {
    const double rough = random.uniform(-0.02, 0.05);
    // Terrace and ramps lie on their own sheets; lawns are rough and stand above the pavement.
    if (plan.lift(p) > 0.0) return Vec3{p.x, p.y, plan.hills(p) - 0.05};
    const double above = surface_at(plan, p) == Surface::kLawn ? 0.025 + rough : 0.0;
    return Vec3{p.x, p.y, plan.hills(p) + above};
  };
  add_sheet(campus.mesh, plan.grounds().low, plan.grounds().high, kCell, position_at,
            [&](Vec2 p) { return surface_at(plan, p); });
}

}  // namespace unimapper::simulator::campus
