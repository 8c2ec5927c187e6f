// Raised terrace with stairs, ramps and railings.
#include <algorithm>

#include "campus.hpp"
#include "src/simulator/sheet.hpp"

namespace unimapper::simulator::campus {
namespace {

/// Visits a line metre by metre.
template <typename Visit>
void for_each_metre(Vec2 from, Vec2 to, Visit visit) {
  const int parts = std::max(1, static_cast<int>(norm(to - from) + 0.5));
  for (int i = 0; i < parts; ++i) {
    visit(from + (static_cast<double>(i) / parts) * (to - from),
          from + ((i + 1.0) / parts) * (to - from));
  }
}

/// Wall below an edge of something raised; `inward` points from the edge to where it is raised.
void add_retaining_wall(const Plan& plan, Mesh& mesh, Vec2 from, Vec2 to, Vec2 inward) {
  for_each_metre(from, to, [&](Vec2 a, Vec2 b) {
    const auto foot = [&](Vec2 p) { return Vec3{p.x, p.y, plan.hills(p) - 0.4}; };
    const auto top = [&](Vec2 p) {
      return Vec3{p.x, p.y, plan.hills(p) + plan.lift(p + 0.02 * inward)};
    };
    mesh.quad(foot(a), foot(b), top(b), top(a), Surface::kStoneWall);
  });
}

/// Posts and two rails along an edge.
void add_railing(const Plan& plan, Mesh& mesh, Vec2 from, Vec2 to) {
  for_each_metre(from, to, [&](Vec2 a, Vec2 b) {
    const Vec3 foot_a = plan.ground(a);
    const Vec3 foot_b = plan.ground(b);
    mesh.tube(foot_a, foot_a + Vec3{0, 0, 1.0}, 0.02, 0.02, 5, Surface::kPoleMetal);
    for (const double z : {0.5, 1.0}) {
      mesh.tube(foot_a + Vec3{0, 0, z}, foot_b + Vec3{0, 0, z}, 0.022, 0.022, 5,
                Surface::kPoleMetal);
    }
  });
}

void add_ramp(const Plan& plan, Mesh& mesh, const Area& ramp) {
  add_sheet(
      mesh, ramp.low, ramp.high, 0.9,
      [&](Vec2 p) {
        // Just inside, where the ramp's own height holds.
        const Vec2 inside = p + 1e-3 * (ramp.centre() - p);
        return Vec3{p.x, p.y, plan.height(inside)};
      },
      [](Vec2) { return Surface::kPlaza; });
  const double inset = 0.12;
  for (const double side : {1.0, -1.0}) {
    const double y = side > 0.0 ? ramp.low.y : ramp.high.y;
    add_retaining_wall(plan, mesh, {ramp.low.x, y}, {ramp.high.x, y}, {0, side});
    const double rail = y + side * inset;
    add_railing(plan, mesh, {ramp.low.x + 0.1, rail}, {ramp.high.x - 0.1, rail});
  }
}

/// Steps that follow the hill: every tread is level along the way up only.
void add_stairs(const Plan& plan, Mesh& mesh) {
  constexpr int kSteps = 8;
  const Area& stairs = plan.stairs();
  const double rise = plan.lift(plan.terrace().centre()) / kSteps;
  const double tread = (stairs.high.y - stairs.low.y) / kSteps;
  for_each_metre({stairs.low.x, 0}, {stairs.high.x, 0}, [&](Vec2 a, Vec2 b) {
    for (int i = 0; i < kSteps; ++i) {
      const double y = stairs.low.y + i * tread;
      const auto at = [&](double x, double along, int level) {
        return Vec3{x, along, plan.hills({x, y}) + rise * level};
      };
      mesh.quad(at(a.x, y, i), at(b.x, y, i), at(b.x, y, i + 1), at(a.x, y, i + 1),
                Surface::kSidewalk);
      mesh.quad(at(a.x, y, i + 1), at(b.x, y, i + 1), at(b.x, y + tread, i + 1),
                at(a.x, y + tread, i + 1), Surface::kSidewalk);
    }
  });
  for (const double side : {1.0, -1.0}) {
    const double x = side > 0.0 ? stairs.low.x : stairs.high.x;
    add_retaining_wall(plan, mesh, {x, stairs.low.y}, {x, stairs.high.y}, {side, 0});
    const double rail = x + 0.1 * side;
    add_railing(plan, mesh, {rail, stairs.low.y + 0.1}, {rail, stairs.high.y});
  }
  add_railing(plan, mesh, {0.1, stairs.low.y + 0.1}, {0.1, stairs.high.y});
}

}  // namespace

void add_terrace(Campus& campus) {
  const Plan& plan = campus.plan;
  Mesh& mesh = campus.mesh;
  const Area& terrace = plan.terrace();
  const double lift = plan.lift(terrace.centre());
  add_sheet(
      mesh, terrace.low, terrace.high, 1.0,
      [&](Vec2 p) {
        return Vec3{p.x, p.y, plan.hills(p) + lift};
      },
      [](Vec2) { return Surface::kPlaza; });
  add_retaining_wall(plan, mesh, terrace.low, {terrace.high.x, terrace.low.y}, {0, 1});
  add_retaining_wall(plan, mesh, terrace.low, {terrace.low.x, terrace.high.y}, {1, 0});
  add_retaining_wall(plan, mesh, {terrace.high.x, terrace.low.y}, terrace.high, {-1, 0});
  const double edge = terrace.low.y + 0.12;
  add_railing(plan, mesh, {terrace.low.x + 0.1, edge}, {plan.stairs().low.x, edge});
  add_railing(plan, mesh, {plan.stairs().high.x, edge}, {terrace.high.x - 0.1, edge});
  for (const Area& ramp : plan.ramps()) {
    add_ramp(plan, mesh, ramp);
    const double x = ramp.low.x < 0.0 ? terrace.low.x + 0.12 : terrace.high.x - 0.12;
    add_railing(plan, mesh, {x, ramp.high.y}, {x, plan.halls()[0].area.low.y - 0.2});
  }
  add_stairs(plan, mesh);
}

}  // namespace unimapper::simulator::campus
