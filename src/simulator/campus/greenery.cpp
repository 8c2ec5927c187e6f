// Campus vegetation: trees, hedges, bushes and the surrounding woods.
#include <algorithm>

#include "campus.hpp"
#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

bool is_lawn(const Plan& plan, Vec2 at, double radius) {
  return !plan.plaza().contains(at, radius) && plan.is_free(at, radius);
}

void add_lawn_trees(Campus& campus, Random& random) {
  const Prototypes& p = campus.prototypes;
  const Area& area = campus.plan.grounds();
  for (int i = 0; i < 620; ++i) {
    const Vec2 at{random.uniform(area.low.x, area.high.x), random.uniform(area.low.y, area.high.y)};
    const bool is_tree = i < 420;
    const std::uint32_t variant = random.index(14);
    const double turn = random.uniform(0.0, 6.28);
    const double scale = random.uniform(0.7, 1.2);
    if (!is_lawn(campus.plan, at, is_tree ? 2.0 : 0.9)) continue;
    add_instance(campus, is_tree ? p.trees : p.bushes, variant, at, turn, scale);
  }
}

/// Rows of trees or hedges along one side of a way.
void add_along(Campus& campus, const Way& way, Random& random) {
  const Prototypes& p = campus.prototypes;
  for (const double side : {-1.0, 1.0}) {
    const double draw = random.uniform();
    const bool is_hedge = draw < 0.35;
    const bool is_row = draw > 0.6;
    if (!is_hedge && !is_row) continue;
    const std::size_t step = is_hedge ? 2 : 8;
    const double distance = way.half_width + (is_hedge ? 1.0 : 2.4);
    const std::uint32_t kind = random.index(11);
    for (std::size_t i = 2; i + 2 < way.points.size(); i += step) {
      const Vec2 along = normalized(way.points[i + 1] - way.points[i - 1]);
      const Vec2 at = way.points[i] + (side * distance) * left_of(along);
      const double turn = std::atan2(along.y, along.x);
      const std::uint32_t variant = random.index(3);
      const double scale = random.uniform(0.75, 0.95);
      if (!is_lawn(campus.plan, at, is_hedge ? 0.75 : 0.6)) continue;
      if (is_hedge) {
        add_instance(campus, p.hedges, variant, at, turn);
      } else {
        add_instance(campus, p.trees, kind + variant % 2, at, 3.0 * variant, scale);
      }
    }
  }
}

void add_woods(Campus& campus, Random& random) {
  const Area& area = campus.plan.grounds();
  const Vec2 half = 0.5 * (area.high - area.low);
  for (int i = 0; i < 420; ++i) {
    const double angle = random.uniform(0.0, 2.0 * kPi);
    const double out = 1.0 + 0.45 * random.uniform();
    const Vec2 round{std::cos(angle), std::sin(angle)};
    // Around the grounds, not in their corners.
    const double reach = out / std::max(std::abs(round.x), std::abs(round.y));
    const Vec2 at = area.centre() + Vec2{reach * half.x * round.x, reach * half.y * round.y};
    add_instance(campus, campus.prototypes.trees, random.index(14), at, random.uniform(0.0, 6.28),
                 random.uniform(0.8, 1.3));
  }
}

}  // namespace

void add_greenery(std::uint64_t seed, Campus& campus) {
  Random lawn(seed, Stream::kBlock, 3);
  add_lawn_trees(campus, lawn);
  std::uint64_t index = 0;
  for (const Way& way : campus.plan.ways()) {
    Random random(seed, Stream::kBlock, 4, index++);
    if (way.half_width > 0.0) add_along(campus, way, random);
  }
  Random woods(seed, Stream::kBlock, 5);
  add_woods(campus, woods);
}

}  // namespace unimapper::simulator::campus
