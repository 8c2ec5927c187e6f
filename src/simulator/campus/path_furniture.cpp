// Campus furniture along the paths: lamps, benches, bins, boards, bicycles, parked cars.
#include <algorithm>

#include "campus.hpp"
#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

/// A lamp for paths: a post with a head, no arm.
Mesh make_path_lamp() {
  Mesh mesh;
  mesh.tube({0, 0, -0.3}, {0, 0, 3.8}, 0.06, 0.045, 8, Surface::kPoleMetal);
  mesh.tube({0, 0, 3.8}, {0, 0, 4.1}, 0.1, 0.2, 8, Surface::kLampHead);
  mesh.disc({0, 0, 4.1}, {0, 0, 1}, 0.22, 8, Surface::kLampHead);
  return mesh;
}

/// Two boards leaning against each other.
Mesh make_board() {
  Mesh mesh;
  for (const double side : {-1.0, 1.0}) {
    mesh.quad({0.25 * side, -0.3, 0.0}, {0.25 * side, 0.3, 0.0}, {0.03 * side, 0.3, 1.05},
              {0.03 * side, -0.3, 1.05}, Surface::kCabinet);
  }
  return mesh;
}

/// A hoop to lock bicycles to, across x.
Mesh make_hoop() {
  Mesh mesh;
  const Vec3 corners[] = {{0, -0.4, -0.1}, {0, -0.4, 0.75}, {0, 0.4, 0.75}, {0, 0.4, -0.1}};
  for (int i = 0; i < 3; ++i) {
    mesh.tube(corners[i], corners[i + 1], 0.025, 0.025, 6, Surface::kPoleMetal);
  }
  return mesh;
}

PrototypeRange add_prototype(Campus& campus, Mesh mesh) {
  campus.prototypes.meshes.push_back(std::move(mesh));
  return {static_cast<std::uint32_t>(campus.prototypes.meshes.size() - 1), 1};
}

/// A spot beside a way, `distance` metres from its pavement.
struct Roadside {
  const Way& way;

  [[nodiscard]] Vec2 along(std::size_t i) const {
    return normalized(way.points[i + 1] - way.points[i - 1]);
  }
  [[nodiscard]] Vec2 at(std::size_t i, double side, double distance) const {
    return way.points[i] + (side * (way.half_width + distance)) * left_of(along(i));
  }
};

/// The plaza stays free: furniture along the ways ends at its edge.
bool is_free_roadside(const Plan& plan, Vec2 at, double radius) {
  return !plan.plaza().contains(at, radius) && plan.is_free(at, radius);
}

/// Small things that are moved or taken away from day to day.
void add_movables(Campus& campus, const Roadside& roadside, PrototypeRange boards, Random& random,
                  Random& daily) {
  const Prototypes& p = campus.prototypes;
  const auto last = static_cast<std::uint32_t>(roadside.way.points.size() - 4);
  const auto small_thing = [&](PrototypeRange range, double distance, double chance, double move) {
    const bool exists = random.chance(chance);
    const double side = random.chance(0.5) ? 1.0 : -1.0;
    const std::size_t i = 2 + random.index(last);
    const bool is_there = !daily.chance(0.08);
    const double shift = daily.uniform(-move, move);
    const Vec2 along = roadside.along(i);
    const Vec2 at = roadside.at(i, side, distance) + shift * along;
    if (!exists || !is_there || !is_free_roadside(campus.plan, at, 0.3)) return;
    // Furniture faces the path.
    add_instance(campus, range, 0, at, std::atan2(along.y, along.x) - 0.5 * kPi * side);
  };
  for (int i = 0; i < 3; ++i) small_thing(p.benches, 0.6, 0.4, 0.0);
  for (int i = 0; i < 2; ++i) small_thing(p.bins, 0.5, 0.35, 1.5);
  small_thing(boards, 0.5, 0.3, 4.0);
}

struct Rack {
  Vec2 from, step;  ///< first hoop, and the way to the next
  int hoops;
};

std::vector<Rack> racks_of(const Plan& plan) {
  const auto halls = plan.halls();
  const Area& south = halls[2].area;
  const Area& west = halls[3].area;
  const Area& library = halls[0].area;
  return {{{south.low.x + 3.0, south.high.y + 1.8}, {0.9, 0}, 12},
          {{south.high.x - 14.0, south.high.y + 1.8}, {0.9, 0}, 14},
          {{south.high.x - 16.0, south.low.y - 1.8}, {0.9, 0}, 10},
          {{west.low.x - 1.8, west.centre().y}, {0, 0.9}, 12},
          {{library.high.x + 2.0, library.low.y + 7.0}, {0, 0.9}, 9}};
}

void add_rack(Campus& campus, const Rack& rack, PrototypeRange hoops, Random& daily) {
  const double turn = std::atan2(rack.step.y, rack.step.x);
  for (int i = 0; i < rack.hoops; ++i) {
    const Vec2 at = rack.from + static_cast<double>(i) * rack.step;
    const bool has_bicycle = daily.chance(0.6);
    const double lean = daily.uniform(-0.12, 0.12);
    const double offset = daily.uniform(-0.2, 0.2);
    if (campus.plan.to_pavement(at) < 0.6 || campus.plan.to_tours(at) < 2.6) continue;
    add_instance(campus, hoops, 0, at, turn);
    if (!has_bicycle) continue;
    const Vec2 across = left_of(normalized(rack.step));
    add_instance(campus, campus.prototypes.bicycles, 0,
                 at + 0.14 * normalized(rack.step) + offset * across, turn + 0.5 * kPi + lean, 1.0,
                 label::kBicycle);
  }
}

void add_parked_cars(std::uint64_t seed, std::uint32_t day, Campus& campus) {
  constexpr double kSlot = 2.7;
  const Area& area = campus.plan.parking();
  const Prototypes& p = campus.prototypes;
  std::uint16_t object = 1;
  std::uint64_t slot = 0;
  for (const double x : {area.low.x + 2.8, area.high.x - 2.8}) {
    for (double y = area.low.y + 2.0; y < area.high.y - 1.5; y += kSlot) {
      // Half of the slots look the same on all days.
      Random habit(seed, Stream::kParking, slot);
      Random random(seed, Stream::kParking, slot, habit.chance(0.5) ? 2 + day : 1);
      ++slot;
      if (!random.chance(0.7)) continue;
      const bool is_van = random.chance(0.1);
      const bool is_reversed = random.chance(0.3);
      const double turn = (is_reversed ? kPi : 0.0) + random.uniform(-0.04, 0.04);
      const PrototypeRange range = is_van ? p.vans : p.cars;
      const Vec2 at{x + random.uniform(-0.3, 0.3), y};
      const Frame frame = sloped_frame(campus.plan.ground(at), {std::cos(turn), std::sin(turn)},
                                       campus.plan.up(at));
      campus.instances.push_back({range.first + random.index(range.count), frame, 1.0,
                                  is_van ? label::kTruck : label::kCar, object++});
    }
  }
}

}  // namespace

void add_path_furniture(std::uint64_t seed, std::uint32_t day, Campus& campus) {
  const PrototypeRange lamps = add_prototype(campus, make_path_lamp());
  const PrototypeRange boards = add_prototype(campus, make_board());
  std::uint64_t index = 0;
  for (const Way& way : campus.plan.ways()) {
    Random random(seed, Stream::kFurniture, 3, index);
    Random daily(seed, Stream::kFurniture, 4 + day, index++);
    if (way.half_width <= 0.0 || way.points.size() < 8) continue;
    const Roadside roadside{way};
    double side = 1.0;
    for (std::size_t i = 3 + random.index(6); i + 3 < way.points.size(); i += 15) {
      // Only where the robot with its companions fits between them.
      const Vec2 at = roadside.at(i, side, std::max(0.5, 2.1 - way.half_width));
      if (is_free_roadside(campus.plan, at, 0.15)) add_instance(campus, lamps, 0, at, 0.0);
      side = -side;
    }
    add_movables(campus, roadside, boards, random, daily);
  }
}

void add_bicycles_and_cars(std::uint64_t seed, std::uint32_t day, Campus& campus) {
  const PrototypeRange hoops = add_prototype(campus, make_hoop());
  std::uint64_t index = 0;
  for (const Rack& rack : racks_of(campus.plan)) {
    Random daily(seed, Stream::kParking, 5000 + index++, day);
    add_rack(campus, rack, hoops, daily);
  }
  add_parked_cars(seed, day, campus);
}

}  // namespace unimapper::simulator::campus
