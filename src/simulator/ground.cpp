// Ground surface of the town: roads, kerbs, sidewalks, lane markings and lawns.
#include <vector>

#include "random.hpp"
#include "sheet.hpp"
#include "town.hpp"

namespace unimapper::simulator {
namespace {

/// Rounded rectangle in plan coordinates, the same number of points whatever the inset.
std::vector<Vec2> rounded_outline(Vec2 low, Vec2 high, double radius, int side_points) {
  constexpr int kArcPoints = 6;
  std::vector<Vec2> outline;
  const Vec2 centres[4] = {{high.x - radius, low.y + radius},
                           {high.x - radius, high.y - radius},
                           {low.x + radius, high.y - radius},
                           {low.x + radius, low.y + radius}};
  for (int corner = 0; corner < 4; ++corner) {
    const double start = (corner - 1) * 0.5 * kPi;
    for (int i = 0; i <= kArcPoints; ++i) {
      const double angle = start + 0.5 * kPi * i / kArcPoints;
      outline.push_back(centres[corner] + radius * Vec2{std::cos(angle), std::sin(angle)});
    }
    const Vec2 from = outline.back();
    const double next_angle = start + 0.5 * kPi;
    const Vec2 to =
        centres[(corner + 1) % 4] + radius * Vec2{std::cos(next_angle), std::sin(next_angle)};
    for (int i = 1; i < side_points; ++i) {
      outline.push_back(from + (static_cast<double>(i) / side_points) * (to - from));
    }
  }
  return outline;
}

void add_ring(const TownPlan& plan, Mesh& mesh, const std::vector<Vec2>& outer, double outer_lift,
              const std::vector<Vec2>& inner, double inner_lift, Surface surface) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
  for (std::size_t i = 0; i < outer.size(); ++i) {
    mesh.vertex(plan.ground(outer[i], outer_lift));
    mesh.vertex(plan.ground(inner[i], inner_lift));
  }
  const auto count = static_cast<std::uint32_t>(outer.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t a = first + 2 * i;
    const std::uint32_t b = first + 2 * ((i + 1) % count);
    mesh.triangle(a, b, b + 1, surface);
    mesh.triangle(a, b + 1, a + 1, surface);
  }
}

/// Dashes along the middle of every street.
void add_markings(const TownPlan& plan, Mesh& mesh) {
  constexpr double kHalfWidth = 0.07;
  constexpr double kLift = 0.006;
  const auto dash = [&](Vec2 at, Vec2 along) {
    const Vec2 side = kHalfWidth * left_of(along);
    const Vec2 end = at + 3.0 * along;
    mesh.quad(plan.ground(at - side, kLift), plan.ground(end - side, kLift),
              plan.ground(end + side, kLift), plan.ground(at + side, kLift), Surface::kMarking);
  };
  for (int line = 0; line < TownPlan::kLines; ++line) {
    for (int part = 0; part < TownPlan::kBlocks; ++part) {
      constexpr double kGap = street::kKerb + 3.0;
      for (double u = plan.line_u(part) + kGap; u < plan.line_u(part + 1) - kGap - 3; u += 6) {
        dash({u, plan.line_v(line)}, {1, 0});
      }
      for (double v = plan.line_v(part) + kGap; v < plan.line_v(part + 1) - kGap - 3; v += 6) {
        dash({plan.line_u(line), v}, {0, 1});
      }
    }
  }
}

void add_block_ground(std::uint64_t seed, const TownPlan& plan, Mesh& mesh, int column, int row) {
  const auto inset = [&](double d, double radius) {
    const double e = street::kKerb + d;
    return rounded_outline({plan.line_u(column) + e, plan.line_v(row) + e},
                           {plan.line_u(column + 1) - e, plan.line_v(row + 1) - e}, radius, 28);
  };
  const double r = street::kCornerRadius;
  const auto edge = inset(0.0, r);
  const auto kerb = inset(0.13, r - 0.13);
  const auto inner = inset(street::kProperty - street::kKerb, 1.2);
  const double top = street::kKerbHeight;
  add_ring(plan, mesh, edge, -0.05, edge, top, Surface::kKerb);
  add_ring(plan, mesh, edge, top, kerb, top, Surface::kKerb);
  add_ring(plan, mesh, kerb, top, inner, top + 0.03, Surface::kSidewalk);

  const BlockKind kind = block_kind(seed, column, row);
  const double e = street::kProperty - 0.5;
  const Vec2 low{plan.line_u(column) + e, plan.line_v(row) + e};
  const Vec2 high{plan.line_u(column + 1) - e, plan.line_v(row + 1) - e};
  Random random(seed, Stream::kBlock, static_cast<std::uint64_t>(column * 16 + row), 77);
  const double path_u = random.uniform(0.3, 0.7) * (high.x - low.x) + low.x;
  const double path_v = random.uniform(0.3, 0.7) * (high.y - low.y) + low.y;
  const auto paint = [&](Vec2 p) {
    if (kind == BlockKind::kPlaza) return Surface::kParkingLot;
    const bool on_path =
        kind == BlockKind::kPark && (std::abs(p.x - path_u) < 1.3 || std::abs(p.y - path_v) < 1.3);
    return on_path ? Surface::kPlaza : Surface::kLawn;
  };
  const double roughness = kind == BlockKind::kPlaza ? 0.004 : 0.03;
  const auto lift = [&](Vec2 p) {
    const bool at_rim =
        p.x < low.x + 0.8 || p.x > high.x - 0.8 || p.y < low.y + 0.8 || p.y > high.y - 0.8;
    // Below the sidewalk's edge at the rim, rough inside.
    return at_rim ? top - 0.04 : top + 0.01 + roughness * random.uniform(-1.0, 1.6);
  };
  add_sheet(
      mesh, low, high, 1.3, [&](Vec2 p) { return plan.ground(p, lift(p)); }, paint);
}

}  // namespace

void add_ground(std::uint64_t seed, Town& town) {
  const TownPlan& plan = town.plan;
  constexpr double kMargin = 150.0;
  const int last = TownPlan::kLines - 1;
  const Vec2 town_low{plan.line_u(0) - street::kKerb, plan.line_v(0) - street::kKerb};
  const Vec2 town_high{plan.line_u(last) + street::kKerb, plan.line_v(last) + street::kKerb};
  const auto paint = [&](Vec2 p) {
    const bool inside =
        p.x > town_low.x && p.y > town_low.y && p.x < town_high.x && p.y < town_high.y;
    return inside ? Surface::kRoad : Surface::kLawn;
  };
  add_sheet(
      town.mesh, {town_low.x - kMargin, town_low.y - kMargin},
      {town_high.x + kMargin, town_high.y + kMargin}, 2.6, [&](Vec2 p) { return plan.ground(p); },
      paint);
  add_markings(plan, town.mesh);
  for (int column = 0; column < TownPlan::kBlocks; ++column) {
    for (int row = 0; row < TownPlan::kBlocks; ++row) {
      add_block_ground(seed, plan, town.mesh, column, row);
    }
  }
}

}  // namespace unimapper::simulator
