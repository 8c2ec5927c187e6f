// Plaza fixtures: fountain, benches, planters, kiosk and market stalls.
#include "campus.hpp"
#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

Frame frame_of(const Plan& plan, const Fixture& fixture) {
  return upright_frame(plan.ground(fixture.at), {std::cos(fixture.turn), std::sin(fixture.turn)});
}

void add_fountain(Mesh& mesh, const Frame& frame) {
  constexpr double kRadius = 2.4;
  const auto ring = [&](double radius, double low, double high, Surface surface) {
    mesh.tube(frame({0, 0, low}), frame({0, 0, high}), radius, radius, 24, surface);
  };
  ring(kRadius, -0.4, 0.5, Surface::kStoneWall);
  ring(kRadius - 0.3, 0.2, 0.5, Surface::kStoneWall);
  mesh.disc(frame({0, 0, 0.35}), {0, 0, 1}, kRadius - 0.3, 24, Surface::kGlass);  // water
  mesh.disc(frame({0, 0, 0.1}), {0, 0, 1}, kRadius, 24, Surface::kStoneWall);
  ring(0.35, 0.0, 1.6, Surface::kStoneWall);
  mesh.tube(frame({0, 0, 1.6}), frame({0, 0, 1.8}), 0.35, 0.9, 16, Surface::kStoneWall);
}

void add_planter(Campus& campus, const Frame& frame, Random& random) {
  campus.mesh.box(frame, {-0.75, -0.75, -0.3}, {0.75, 0.75, 0.55}, Surface::kConcrete);
  Frame soil = frame;
  soil.origin.z += 0.5;
  campus.instances.push_back(
      {campus.prototypes.trees.first + random.index(11), soil, random.uniform(0.5, 0.65), 0, 0});
}

/// Open towards -x, where people queue; its roof covers the head of the queue.
void add_kiosk(Mesh& mesh, const Frame& frame) {
  mesh.box(frame, {-1.5, -1.2, -0.4}, {-1.4, 1.2, 1.1}, Surface::kWoodFence);  // counter
  mesh.box(frame, {-1.75, -1.2, 1.1}, {-1.2, 1.2, 1.15}, Surface::kWoodFence);
  mesh.box(frame, {1.4, -1.2, -0.4}, {1.5, 1.2, 2.5}, Surface::kPlaster);
  for (const double y : {-1.2, 1.1}) {
    mesh.box(frame, {-1.5, y, -0.4}, {1.5, y + 0.1, 2.5}, Surface::kPlaster);
  }
  mesh.box(frame, {-2.6, -1.5, 2.5}, {1.8, 1.5, 2.62}, Surface::kRoof);
}

/// A market stall: a table below a tarpaulin on four poles.
void add_stall(Mesh& mesh, const Frame& frame) {
  for (const double x : {-1.2, 1.2}) {
    for (const double y : {-0.8, 0.8}) {
      mesh.tube(frame({x, y, -0.1}), frame({x, y, 2.2}), 0.025, 0.025, 5, Surface::kPoleMetal);
    }
  }
  mesh.box(frame, {-1.1, -0.6, 0.7}, {1.1, 0.3, 0.78}, Surface::kBench);
  mesh.box(frame, {-1.0, -0.5, 0.0}, {-0.4, 0.2, 0.5}, Surface::kCabinet);
  const Vec3 top = frame({0, 0, 2.75});
  const Vec3 corners[4] = {frame({-1.4, -1.0, 2.15}), frame({1.4, -1.0, 2.15}),
                           frame({1.4, 1.0, 2.15}), frame({-1.4, 1.0, 2.15})};
  for (int i = 0; i < 4; ++i) {
    mesh.triangle(corners[i], corners[(i + 1) % 4], top, Surface::kCabinet);
  }
}

}  // namespace

void add_plaza(std::uint64_t seed, std::uint32_t day, Campus& campus) {
  const Plan& plan = campus.plan;
  Random random(seed, Stream::kFurniture, 1);
  Random daily(seed, Stream::kFurniture, 2, day);
  for (const Fixture& fixture : plan.fixtures()) {
    const Frame frame = frame_of(plan, fixture);
    switch (fixture.kind) {
      case FixtureKind::kFountain:
        add_fountain(campus.mesh, frame);
        break;
      case FixtureKind::kBench:
        add_instance(campus, campus.prototypes.benches, 0, fixture.at, fixture.turn);
        break;
      case FixtureKind::kPlanter:
        add_planter(campus, frame, random);
        break;
      case FixtureKind::kKiosk:
        add_kiosk(campus.mesh, frame);
        break;
      case FixtureKind::kStall:
        if (daily.chance(0.6)) add_stall(campus.mesh, frame);
        break;
    }
  }
  // Bollards keep cars off the plaza.
  const Area& plaza = plan.plaza();
  for (const double x : {plaza.low.x + 0.3, plaza.high.x - 0.3}) {
    for (double y = plaza.low.y + 1.0; y < plaza.high.y; y += 1.6) {
      if (plan.is_free({x, y}, 0.1))
        add_instance(campus, campus.prototypes.bollards, 0, {x, y}, 0.0);
    }
  }
}

}  // namespace unimapper::simulator::campus
