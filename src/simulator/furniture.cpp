// Street furniture: prototypes and their positions along the kerbs.
#include "random.hpp"
#include "town.hpp"

namespace unimapper::simulator {
namespace {

Mesh make_lamp() {
  Mesh mesh;
  mesh.tube({0, 0, -0.3}, {0, 0, 1.0}, 0.09, 0.08, 8, Surface::kPoleMetal);
  mesh.tube({0, 0, 1.0}, {0, 0, 6.6}, 0.075, 0.05, 8, Surface::kPoleMetal);
  mesh.tube({0, 0, 6.6}, {1.7, 0, 7.1}, 0.04, 0.035, 6, Surface::kPoleMetal);
  mesh.box({}, {1.5, -0.12, 7.03}, {2.2, 0.12, 7.15}, Surface::kLampHead);
  return mesh;
}

Mesh make_utility_pole() {
  Mesh mesh;
  mesh.tube({0, 0, -0.3}, {0, 0, 8.4}, 0.15, 0.1, 8, Surface::kPoleWood);
  mesh.box({}, {-0.05, -0.9, 7.8}, {0.05, 0.9, 7.92}, Surface::kPoleWood);
  mesh.box({}, {-0.25, 0.14, 5.6}, {0.25, 0.5, 6.3}, Surface::kCabinet);
  return mesh;
}

/// Facing -x, towards the traffic that comes along +x.
Mesh make_sign(int kind) {
  Mesh mesh;
  mesh.tube({0, 0, -0.3}, {0, 0, 2.75}, 0.035, 0.035, 6, Surface::kPoleMetal);
  const double z = 2.4;
  if (kind == 0) {
    mesh.disc({-0.05, 0, z}, {1, 0, 0}, 0.32, 14, Surface::kSign);
    mesh.disc({-0.04, 0, z}, {1, 0, 0}, 0.32, 14, Surface::kSignBack);
  } else if (kind == 1) {
    mesh.triangle({-0.05, -0.42, z - 0.3}, {-0.05, 0.42, z - 0.3}, {-0.05, 0, z + 0.42},
                  Surface::kSign);
    mesh.triangle({-0.04, -0.42, z - 0.3}, {-0.04, 0.42, z - 0.3}, {-0.04, 0, z + 0.42},
                  Surface::kSignBack);
  } else {
    mesh.quad({-0.05, -0.5, z - 0.22}, {-0.05, 0.5, z - 0.22}, {-0.05, 0.5, z + 0.3},
              {-0.05, -0.5, z + 0.3}, Surface::kSign);
    mesh.quad({-0.04, -0.5, z - 0.22}, {-0.04, 0.5, z - 0.22}, {-0.04, 0.5, z + 0.3},
              {-0.04, -0.5, z + 0.3}, Surface::kSignBack);
  }
  return mesh;
}

Mesh make_traffic_light() {
  Mesh mesh;
  mesh.tube({0, 0, -0.3}, {0, 0, 3.4}, 0.07, 0.06, 8, Surface::kPoleMetal);
  mesh.box({}, {-0.2, -0.16, 2.4}, {-0.02, 0.16, 3.35}, Surface::kPoleMetal);
  mesh.box({}, {-0.28, -0.16, 3.0}, {-0.2, 0.16, 3.04}, Surface::kPoleMetal);
  return mesh;
}

Mesh make_bin() {
  Mesh mesh;
  mesh.tube({0, 0, -0.1}, {0, 0, 0.85}, 0.22, 0.26, 10, Surface::kBin);
  mesh.disc({0, 0, 0.85}, {0, 0, 1}, 0.26, 10, Surface::kBin);
  return mesh;
}

Mesh make_bench() {
  Mesh mesh;
  for (const double y : {-0.7, 0.7}) {
    mesh.box({}, {-0.22, y - 0.04, -0.1}, {0.22, y + 0.04, 0.42}, Surface::kBench);
  }
  for (int i = 0; i < 4; ++i) {
    const double x = -0.2 + 0.11 * i;
    mesh.box({}, {x, -0.85, 0.42}, {x + 0.08, 0.85, 0.46}, Surface::kBench);
  }
  mesh.box({}, {-0.26, -0.85, 0.55}, {-0.22, 0.85, 0.68}, Surface::kBench);
  mesh.box({}, {-0.3, -0.85, 0.75}, {-0.26, 0.85, 0.88}, Surface::kBench);
  return mesh;
}

Mesh make_cabinet() {
  Mesh mesh;
  mesh.box({}, {-0.55, -0.2, -0.1}, {0.55, 0.2, 1.25}, Surface::kCabinet);
  mesh.box({}, {-0.6, -0.24, 1.25}, {0.6, 0.24, 1.32}, Surface::kCabinet);
  return mesh;
}

Mesh make_bollard() {
  Mesh mesh;
  mesh.tube({0, 0, -0.1}, {0, 0, 0.95}, 0.06, 0.06, 8, Surface::kPoleMetal);
  mesh.disc({0, 0, 0.95}, {0, 0, 1}, 0.06, 8, Surface::kPoleMetal);
  return mesh;
}

/// Open towards -y, the road.
Mesh make_shelter() {
  Mesh mesh;
  for (const double x : {-1.8, 1.8}) {
    for (const double y : {-0.4, 0.8}) {
      mesh.tube({x, y, -0.1}, {x, y, 2.4}, 0.04, 0.04, 6, Surface::kPoleMetal);
    }
    mesh.quad({x, -0.2, 0.2}, {x, 0.8, 0.2}, {x, 0.8, 2.2}, {x, -0.2, 2.2}, Surface::kGlass);
  }
  mesh.quad({-1.8, 0.8, 0.2}, {1.8, 0.8, 0.2}, {1.8, 0.8, 2.2}, {-1.8, 0.8, 2.2}, Surface::kGlass);
  mesh.box({}, {-2.0, -0.7, 2.4}, {2.0, 0.95, 2.5}, Surface::kCabinet);
  mesh.box({}, {-1.5, 0.4, 0.42}, {1.5, 0.7, 0.48}, Surface::kBench);
  return mesh;
}

/// One side of one street between two crossings.
struct KerbSide {
  Vec2 start, along, outward;  ///< plan coordinates; outward points from the road to the houses
  double length;
  std::uint64_t id;
};

template <typename Visit>
void for_each_kerb_side(const TownPlan& plan, Visit visit) {
  std::uint64_t id = 0;
  for (int line = 0; line < TownPlan::kLines; ++line) {
    for (int part = 0; part < TownPlan::kBlocks; ++part) {
      for (const double side : {-1.0, 1.0}) {
        const double u0 = plan.line_u(part);
        const double v0 = plan.line_v(part);
        visit(
            KerbSide{{u0, plan.line_v(line)}, {1, 0}, {0, side}, plan.line_u(part + 1) - u0, id++});
        visit(
            KerbSide{{plan.line_u(line), v0}, {0, 1}, {side, 0}, plan.line_v(part + 1) - v0, id++});
      }
    }
  }
}

class FurnitureBuilder {
 public:
  FurnitureBuilder(Town& town, const KerbSide& side, std::uint64_t seed, std::uint32_t day)
      : town_(town), side_(side), seed_(seed), day_(day) {}

  /// `from_centre` metres from the street's centre line, x along the kerb plus `turn`.
  void add(PrototypeRange range, std::uint32_t variant, double at, double from_centre,
           double turn = 0.0, double scale = 1.0) {
    const Vec2 plan = side_.start + at * side_.along + from_centre * side_.outward;
    Frame frame = town_.plan.level_frame(plan, side_.along, street::kKerbHeight);
    frame = frame * rotation_frame({0, 0, turn});
    const bool is_bicycle = range.first == town_.prototypes.bicycles.first;
    const std::uint16_t own = is_bicycle ? label::kBicycle : label::kOfObject;
    town_.instances.push_back({range.first + variant % range.count, frame, scale, own, 0});
  }

  /// Some small things are moved or gone on another day; `item` numbers them along the side.
  [[nodiscard]] double daily_shift(std::uint64_t item, bool& is_there) const {
    Random random(seed_ + 7919ULL * day_, Stream::kFurniture, side_.id, 1000 + item);
    is_there = day_ == 0 || !random.chance(0.06);
    return day_ != 0 && random.chance(0.08) ? random.uniform(-1.5, 1.5) : 0.0;
  }

 private:
  Town& town_;
  const KerbSide& side_;
  std::uint64_t seed_;
  std::uint32_t day_;
};

void add_wires(Town& town, Vec3 from, Vec3 to, Vec3 across) {
  constexpr int kParts = 8;
  for (const double offset : {-0.8, 0.0, 0.8}) {
    Vec3 previous = from + offset * across;
    for (int i = 1; i <= kParts; ++i) {
      const double w = static_cast<double>(i) / kParts;
      Vec3 next = lerp(from, to, w) + offset * across;
      next.z -= 4.0 * 0.6 * w * (1.0 - w);
      town.mesh.tube(previous, next, 0.012, 0.012, 3, Surface::kWire);
      previous = next;
    }
  }
}

}  // namespace

void add_furniture_prototypes(Prototypes& prototypes) {
  auto& meshes = prototypes.meshes;
  const auto add = [&](PrototypeRange& range, auto... made) {
    range = {static_cast<std::uint32_t>(meshes.size()), sizeof...(made)};
    (meshes.push_back(made), ...);
  };
  add(prototypes.lamps, make_lamp());
  add(prototypes.utility_poles, make_utility_pole());
  add(prototypes.signs, make_sign(0), make_sign(1), make_sign(2));
  add(prototypes.traffic_lights, make_traffic_light());
  add(prototypes.bins, make_bin());
  add(prototypes.benches, make_bench());
  add(prototypes.cabinets, make_cabinet());
  add(prototypes.bollards, make_bollard());
  add(prototypes.shelters, make_shelter());
}

void add_street_furniture(std::uint64_t seed, std::uint32_t day, Town& town) {
  const Prototypes& p = town.prototypes;
  for_each_kerb_side(town.plan, [&](const KerbSide& side) {
    Random random(seed, Stream::kFurniture, side.id);
    FurnitureBuilder builder(town, side, seed, day);
    const double first = street::kProperty + 3.5;
    const double last = side.length - first;
    // Lamps stand on one side of a street only; wires on the other.
    const bool is_lamp_side = (side.outward.x + side.outward.y) > 0.0;
    const double edge = street::kKerb + 0.45;
    if (is_lamp_side) {
      for (double at = first + random.uniform(0, 8); at < last; at += random.uniform(26, 32)) {
        builder.add(p.lamps, 0, at, edge, side.along.x > 0 ? -0.5 * kPi : 0.5 * kPi);
      }
    } else if (random.chance(0.45)) {
      const double step = (last - first) / 2.0;
      Frame previous{};
      for (int i = 0; i < 3; ++i) {
        const double at = first + step * i;
        builder.add(p.utility_poles, 0, at, edge);
        const Frame& pole = town.instances.back().frame;
        if (i > 0) {
          add_wires(town, previous({0, 0, 7.95}), pole({0, 0, 7.95}), pole.y);
        }
        previous = pole;
      }
    }
    const double tree_spacing = random.chance(0.75) ? random.uniform(8, 14) : 1e9;
    for (double at = first + 4.0 + random.uniform(0, 5); at < last; at += tree_spacing) {
      if (random.chance(0.85) && tree_spacing < 1e8) {
        builder.add(p.trees, random.index(11), at, edge + 0.3, random.uniform(0, 6.28),
                    random.uniform(0.7, 1.0));
      }
    }
    std::uint64_t item = 0;
    const auto small_thing = [&](PrototypeRange range, double from_centre, double turn) {
      bool is_there = true;
      const double shift = builder.daily_shift(item++, is_there);
      const double at = random.uniform(first, last);
      const std::uint32_t variant = random.index(8);
      if (is_there) builder.add(range, variant, at + shift, from_centre, turn);
    };
    const double facing =
        (side.outward.x - side.outward.y) * (side.along.x - side.along.y) > 0 ? 0.0 : kPi;
    const std::uint32_t signs = 1 + random.index(3);
    for (std::uint32_t i = 0; i < signs; ++i) small_thing(p.signs, edge, facing);
    if (random.chance(0.6)) small_thing(p.bins, edge + 0.1, 0.0);
    if (random.chance(0.5)) small_thing(p.bins, street::kProperty - 0.35, 0.0);
    if (random.chance(0.35)) small_thing(p.benches, street::kProperty - 0.4, 0.5 * kPi);
    if (random.chance(0.5)) small_thing(p.cabinets, street::kProperty - 0.3, 0.0);
    if (random.chance(0.4)) small_thing(p.bicycles, street::kProperty - 0.4, 0.2);
    if (random.chance(0.12)) {
      builder.add(p.shelters, 0, 0.5 * side.length, street::kKerb + 1.4,
                  side.outward.y - side.outward.x > 0 ? 0.0 : kPi);
    }
    if (random.chance(0.25)) {
      for (int i = 0; i < 5; ++i) builder.add(p.bollards, 0, first + 1.6 * i, edge - 0.1);
    }
    if (side.id % 4 < 2) builder.add(p.traffic_lights, 0, street::kProperty + 1.0, edge, facing);
  });
}

void add_parked_cars(std::uint64_t seed, std::uint32_t day, Town& town) {
  std::uint16_t object = 1;
  constexpr double kSlot = 6.1;
  for_each_kerb_side(town.plan, [&](const KerbSide& side) {
    const double first = street::kProperty + 7.0;
    const int slots = static_cast<int>((side.length - 2.0 * first) / kSlot);
    Random street_random(seed, Stream::kParking, side.id, 99999);
    const double demand = street_random.uniform(0.25, 0.75);
    for (int slot = 0; slot < slots; ++slot) {
      const auto slot_id = static_cast<std::uint64_t>(slot);
      // Half of the slots are drawn anew every day, the others look the same on all days.
      Random habit(seed, Stream::kParking, side.id, slot_id);
      const bool changes = habit.chance(0.5);
      Random random(changes ? seed + 104729ULL * (day + 1) : seed, Stream::kParking, side.id,
                    10000 + slot_id);
      if (!random.chance(demand)) continue;
      const bool is_van = random.chance(0.1);
      const PrototypeRange range = is_van ? town.prototypes.vans : town.prototypes.cars;
      const double at = first + kSlot * (slot + 0.5) + random.uniform(-0.4, 0.4);
      const double lateral = street::kParkedCar + random.uniform(-0.12, 0.12);
      const Vec2 plan = side.start + at * side.along + lateral * side.outward;
      // Right-hand traffic: parked with the flow, a few the wrong way round.
      const bool with_along = cross(side.outward, side.along) > 0.0;
      const bool reversed = random.chance(0.07);
      Frame frame =
          town.plan.tilted_frame(plan, with_along != reversed ? side.along : -1.0 * side.along);
      frame = frame * rotation_frame({0, 0, random.uniform(-0.03, 0.03)});
      town.instances.push_back({range.first + random.index(range.count), frame, 1.0,
                                is_van ? label::kTruck : label::kCar, object++});
    }
  });
}

}  // namespace unimapper::simulator
