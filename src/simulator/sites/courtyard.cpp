// Courtyard between houses, and the mirrored one of the building beside it.
#include "src/simulator/displaced_scene.hpp"
#include "src/simulator/sites/site_scene.hpp"

namespace unimapper::simulator::sites::courtyard {
namespace {

struct Size {
  double half_length, half_width;
};

Size size_of(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 9);
  return {random.uniform(18.0, 26.0), random.uniform(12.0, 17.0)};
}

void make_plan(std::uint64_t seed, Plan& plan) {
  const Size size = size_of(seed);
  const double x = size.half_length - 4.0;
  const double y = size.half_width - 4.0;
  plan.set_tours(rounded_loop({{-x, -y}, {x, -y}, {x, y}, {-x, y}}), 4.0, 12.0, 4.0);
  plan.robot = {1.2, 0.8, 0.8, 0.4, 1.8, 30.0};
  for (const double outward : {-2.0, 1.4}) {
    plan.walks.push_back(rounded_loop({{-x - outward, -y - outward},
                                       {x + outward, -y - outward},
                                       {x + outward, y + outward},
                                       {-x - outward, y + outward}}));
  }
}

/// Rows of houses without a gap, their fronts to the yard.
void add_houses(const Size& size, Random& random, Site& site) {
  const Vec2 half{size.half_length, size.half_width};
  for (int side = 0; side < 4; ++side) {
    const double along = side % 2 == 0 ? half.x : half.y;
    const double away = side % 2 == 0 ? half.y : half.x;
    const Frame turn = rotation_frame({0, 0, 0.5 * kPi * side});
    for (double x = -along; x < along - 0.1;) {
      double width = random.uniform(6.0, 11.0);
      if (along - (x + width) < 5.0) width = along - x;
      Frame front;
      front.origin = {x, away, 0.0};
      const HouseShape shape{
          width, random.uniform(8.0, 11.0), 3.0, 0.3, 3 + static_cast<int>(random.index(3)), false};
      add_house(site.mesh, turn * front, shape, random);
      x += width;
    }
  }
}

/// Trees and benches inside the tour, bushes and bins along the fronts.
void add_furnishing(const Size& size, Random& random, Site& site) {
  const Prototypes& p = site.prototypes;
  const double x = size.half_length - 6.5;
  const double y = size.half_width - 6.5;
  for (int i = 0; i < 7; ++i) {
    const Vec2 at{random.uniform(-x, x), random.uniform(-y, y)};
    const double turn = random.uniform(0.0, 2.0 * kPi);
    if (i < 4) {
      site.place(p.trees, random.index(11), at, turn, 0, 0, random.uniform(0.5, 0.8));
    } else {
      site.place(p.benches, 0, at, turn);
    }
  }
  for (int i = 0; i < 12; ++i) {
    const double side = random.chance(0.5) ? 1.0 : -1.0;
    const Vec2 at{random.uniform(-x, x), side * (size.half_width - random.uniform(0.7, 1.2))};
    const bool is_bush = random.chance(0.5);
    site.place(is_bush ? p.bushes : p.bins, is_bush ? random.index(6) : 0, at,
               random.uniform(0.0, 2.0 * kPi));
  }
}

Site build_courtyard(std::uint64_t seed, std::uint32_t day) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(seed, site.plan);
  const Size size = size_of(seed);
  const Vec2 corner{size.half_length + 12.0, size.half_width + 12.0};
  site.sheet({-corner.x, -corner.y}, corner, 0.0, Surface::kPlaza);
  Random houses(seed, Stream::kBlock, 9);
  add_houses(size, houses, site);
  Random furniture(seed, Stream::kFurniture, 9);
  add_furnishing(size, furniture, site);
  // Bicycles lean elsewhere every day.
  Random bicycles(seed, Stream::kParking, 9, day);
  for (int i = 0; i < 8; ++i) {
    const double side = bicycles.chance(0.5) ? 1.0 : -1.0;
    const Vec2 at{side * (size.half_length - 1.2),
                  bicycles.uniform(-size.half_width + 3.0, size.half_width - 3.0)};
    site.place(site.prototypes.bicycles, 0, at, bicycles.uniform(-0.2, 0.2));
  }
  return site;
}

ActorSet simulate_courtyard(const Plan& plan, const Robot& robot, const Visit& visit) {
  return simulate_walkers(robot, visit, 9, 8,
                          [&](Random& random) { return walker_on_either(plan, random); });
}

}  // namespace
}  // namespace unimapper::simulator::sites::courtyard

namespace unimapper::simulator {

std::unique_ptr<Scene> make_courtyard_scene(const Visit& visit) {
  using namespace sites::courtyard;
  Frame mirrored_beside;
  mirrored_beside.y = {0.0, -1.0, 0.0};
  mirrored_beside.origin = {0.0, 80.0, 0.0};
  return make_original_or_copy(visit, mirrored_beside, [](const Visit& place) {
    return sites::make_site_scene(place, build_courtyard, simulate_courtyard);
  });
}

}  // namespace unimapper::simulator
