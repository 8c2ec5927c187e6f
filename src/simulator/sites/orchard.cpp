// Orchard in rows between hedges, where some trees are missing, and another one with other gaps.
#include "src/simulator/displaced_scene.hpp"
#include "src/simulator/sites/site_scene.hpp"

namespace unimapper::simulator::sites::orchard {
namespace {

constexpr double kHalfLength = 60.0;
constexpr double kHalfWidth = 18.0;
constexpr double kAlley = 6.0;     // metres from row to row
constexpr double kTreeStep = 4.0;  // and from tree to tree
constexpr double kMissing = 0.12;  // share of the trees

void make_plan(Plan& plan) {
  const double x = kHalfLength - 3.0;
  // Along one alley and back along another.
  plan.set_tours(rounded_loop({{-x, -kAlley}, {x, -kAlley}, {x, kAlley}, {-x, kAlley}}), 4.0, 30.0,
                 4.0);
  plan.robot = {1.8, 0.8, 1.0, 0.8, 1.4, 40.0};
  plan.walks.push_back(rounded_loop({{-x, 0.0}, {x, 0.0}, {x, 2.0 * kAlley}, {-x, 2.0 * kAlley}}));
}

/// Rows of trees of one kind and nearly one size; what is missing, and how large each is, tells
/// places apart.
void add_trees(std::uint64_t seed, std::uint64_t place, Site& site) {
  Random kind(seed, Stream::kFurniture, 13);
  const std::uint32_t variant = kind.index(11);
  Random random(seed, Stream::kFurniture, 14, place);
  for (double y = -kHalfWidth + 0.5 * kAlley; y < kHalfWidth; y += kAlley) {
    for (double x = -kHalfLength + 5.0; x < kHalfLength - 4.0; x += kTreeStep) {
      const bool is_missing = random.chance(kMissing);
      const double scale = random.uniform(0.32, 0.4);
      const double turn = random.uniform(0.0, 2.0 * kPi);
      const Vec2 off{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
      if (!is_missing)
        site.place(site.prototypes.trees, variant, Vec2{x, y} + off, turn, 0, 0, scale);
    }
  }
}

Site build_orchard(std::uint64_t seed, std::uint32_t day) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(site.plan);
  const Vec2 corner{kHalfLength, kHalfWidth};
  site.sheet(-1.0 * corner, corner, 0.0, Surface::kLawn);
  for (const double side : {-1.0, 1.0}) {
    const double y = side * kHalfWidth;
    site.block({-corner.x, y - 0.3}, {corner.x, y + 0.3}, 0.0, 2.4, Surface::kHedgeCore);
    const double x = side * kHalfLength;
    site.block({x - 0.3, -corner.y}, {x + 0.3, corner.y}, 0.0, 2.4, Surface::kHedgeCore);
  }
  add_trees(seed, (day & kDaysOfCopy) == 0 ? 0 : 1, site);
  // Crates stand elsewhere every day.
  Random crates(seed, Stream::kParking, 13, day);
  for (int i = 0; i < 10; ++i) {
    const Vec2 at{crates.uniform(-kHalfLength + 6.0, kHalfLength - 6.0),
                  (crates.chance(0.5) ? 1.0 : -1.0) * kAlley + (crates.chance(0.5) ? 2.2 : -2.2)};
    site.block(at - Vec2{0.5, 0.4}, at + Vec2{0.5, 0.4}, 0.0, crates.uniform(0.4, 1.0),
               Surface::kBin);
  }
  return site;
}

ActorSet simulate_orchard(const Plan& plan, const Robot& robot, const Visit& visit) {
  return simulate_walkers(robot, visit, 13, 4, [&](Random& random) {
    Stroller s;
    s.path = &plan.walks.front();
    s.cruise = random.uniform(0.8, 1.4);
    s.at = random.uniform(0.0, s.path->length());
    return s;
  });
}

}  // namespace
}  // namespace unimapper::simulator::sites::orchard

namespace unimapper::simulator {

std::unique_ptr<Scene> make_orchard_scene(const Visit& visit) {
  using namespace sites::orchard;
  Frame beside;
  beside.origin = {0.0, 60.0, 0.0};
  return make_original_or_copy(visit, beside, [](const Visit& place) {
    return sites::make_site_scene(place, build_orchard, simulate_orchard);
  });
}

}  // namespace unimapper::simulator
