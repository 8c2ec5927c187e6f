// Square court that is the same from all four sides but for a kiosk, and the one beside it without.
#include "src/simulator/displaced_scene.hpp"
#include "src/simulator/sites/site_scene.hpp"

namespace unimapper::simulator::sites::quad {
namespace {

constexpr double kHalf = 24.0;       // metres from the middle to a front
constexpr double kHouseWidth = 8.0;  // six fronts a side

void make_plan(Plan& plan) {
  const auto loop = [](double half) {
    return rounded_loop({{-half, -half}, {half, -half}, {half, half}, {-half, half}});
  };
  plan.set_tours(loop(kHalf - 7.0), 4.0, 20.0, 4.0);
  plan.robot = {1.4, 0.8, 0.8, 0.4, 1.8, 30.0};
  for (const double half : {kHalf - 9.0, kHalf - 5.0}) plan.walks.push_back(loop(half));
}

/// One side, turned three times: equal fronts, trees, benches and bins at equal places.
void add_sides(std::uint64_t seed, Site& site) {
  Random choice(seed, Stream::kFurniture, 11);
  const Prototypes& p = site.prototypes;
  const std::uint32_t tree = choice.index(11);
  const double tree_x = choice.uniform(2.0, 9.0);
  const double bench_x = choice.uniform(-9.0, -2.0);
  const double height_m = choice.uniform(8.0, 11.0);
  for (int side = 0; side < 4; ++side) {
    const double turn = 0.5 * kPi * side;
    const Frame turned = rotation_frame({0, 0, turn});
    for (double x = -kHalf; x < kHalf - 0.1; x += kHouseWidth) {
      Random same(seed, Stream::kBlock, 11);
      Frame front;
      front.origin = {x, kHalf, 0.0};
      add_house(site.mesh, turned * front, {kHouseWidth, height_m, 3.0, 0.3, 3, false}, same);
    }
    const auto at = [&](double x, double y) {
      const Vec3 placed = turned(Vec3{x, y, 0.0});
      return Vec2{placed.x, placed.y};
    };
    site.place(p.trees, tree, at(tree_x, kHalf - 12.0), turn, 0, 0, 0.7);
    site.place(p.benches, 0, at(bench_x, kHalf - 11.0), turn);
    site.place(p.bins, 0, at(bench_x + 1.5, kHalf - 11.0), turn);
  }
}

/// All that tells the sides apart.
void add_kiosk(std::uint64_t seed, Site& site) {
  Random random(seed, Stream::kFurniture, 12);
  const Vec2 low{random.uniform(2.0, 6.0), -kHalf + 10.0};
  site.block(low, low + Vec2{random.uniform(3.0, 5.0), 2.5}, 0.0, 2.6, Surface::kCabinet);
  const Vec2 board{low.x - 4.0, low.y + 1.0};
  site.block(board, board + Vec2{0.2, 1.6}, 0.0, 2.0, Surface::kCabinet);
}

Site build_quad(std::uint64_t seed, std::uint32_t day) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(site.plan);
  site.sheet({-kHalf - 12.0, -kHalf - 12.0}, {kHalf + 12.0, kHalf + 12.0}, 0.0, Surface::kPlaza);
  add_sides(seed, site);
  if ((day & kDaysOfCopy) == 0) add_kiosk(seed, site);
  // Bicycles lean elsewhere every day.
  Random bicycles(seed, Stream::kParking, 11, day);
  for (int i = 0; i < 8; ++i) {
    const Vec2 at{bicycles.uniform(-kHalf + 3.0, kHalf - 3.0),
                  (bicycles.chance(0.5) ? 1.0 : -1.0) * (kHalf - 1.2)};
    site.place(site.prototypes.bicycles, 0, at, bicycles.uniform(1.3, 1.8));
  }
  return site;
}

ActorSet simulate_quad(const Plan& plan, const Robot& robot, const Visit& visit) {
  return simulate_walkers(robot, visit, 11, 8,
                          [&](Random& random) { return walker_on_either(plan, random); });
}

}  // namespace
}  // namespace unimapper::simulator::sites::quad

namespace unimapper::simulator {

std::unique_ptr<Scene> make_quad_scene(const Visit& visit) {
  using namespace sites::quad;
  Frame beside;
  beside.origin = {0.0, 100.0, 0.0};
  return make_original_or_copy(visit, beside, [](const Visit& place) {
    return sites::make_site_scene(place, build_quad, simulate_quad);
  });
}

}  // namespace unimapper::simulator
