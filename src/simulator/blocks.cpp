// City blocks of the town: houses, gardens, parks, squares and the surrounding woods.
#include <algorithm>

#include "random.hpp"
#include "town.hpp"

namespace unimapper::simulator {
namespace {

constexpr double kGroundLift = street::kKerbHeight;
constexpr double kCornerReserve = 18.5;  // depth of the neighbouring side's last lot

/// One side of a block: s along the property line, d into the block.
struct BlockSide {
  const TownPlan& plan;
  Vec2 start, along, inward;
  double length;

  [[nodiscard]] Vec2 at(double s, double d) const { return start + s * along + d * inward; }
};

enum class Boundary { kNone, kHedge, kFence, kWall };

void add_instance(Town& town, PrototypeRange range, std::uint32_t variant, Vec2 plan, Vec2 along,
                  double turn, double scale) {
  Frame frame = town.plan.level_frame(plan, along, kGroundLift);
  frame = frame * rotation_frame({0, 0, turn});
  town.instances.push_back({range.first + variant % range.count, frame, scale, 0, 0});
}

void add_boundary_piece(Town& town, const BlockSide& side, double s, double d, Boundary kind,
                        double height, bool across, Random& random) {
  const Vec2 along = across ? side.inward : side.along;
  const Vec2 centre = side.at(s, d);
  if (kind == Boundary::kHedge) {
    add_instance(town, town.prototypes.hedges, random.index(3), centre, along, 0.0, 1.0);
    return;
  }
  const Frame frame = town.plan.level_frame(centre, along, kGroundLift);
  if (kind == Boundary::kWall) {
    town.mesh.box(frame, {-1.02, -0.12, -0.6}, {1.02, 0.12, height}, Surface::kStoneWall);
    return;
  }
  town.mesh.box(frame, {-1.0, -0.05, -0.3}, {-0.9, 0.05, height + 0.1}, Surface::kWoodFence);
  for (const double z : {0.25, height - 0.2}) {
    town.mesh.box(frame, {-1.0, 0.0, z}, {1.0, 0.04, z + 0.07}, Surface::kWoodFence);
  }
  for (int i = 0; i < 12; ++i) {
    const double x = -0.96 + 0.165 * i;
    town.mesh.quad(frame({x, -0.02, 0.06}), frame({x + 0.1, -0.02, 0.06}),
                   frame({x + 0.1, -0.02, height}), frame({x, -0.02, height}), Surface::kWoodFence);
  }
}

void add_boundary(Town& town, const BlockSide& side, double s0, double s1, double d, Boundary kind,
                  double gate, Random& random) {
  const double height = random.uniform(0.8, 1.6);
  for (double s = s0 + 1.0; s < s1 - 0.9; s += 2.0) {
    if (std::abs(s - gate) < 1.4) continue;
    add_boundary_piece(town, side, s, d, kind, height, false, random);
  }
}

Boundary random_boundary(Random& random) {
  const double draw = random.uniform();
  if (draw < 0.42) return Boundary::kHedge;
  if (draw < 0.7) return Boundary::kFence;
  if (draw < 0.88) return Boundary::kWall;
  return Boundary::kNone;
}

/// House on the lot [s, s + width] with its front `setback` behind the property line.
void add_lot(Town& town, const BlockSide& side, double s, double width, double setback,
             bool is_terrace, Random& random) {
  HouseShape shape{};
  shape.width = width;
  shape.depth = random.uniform(8.0, 11.0);
  shape.storeys =
      is_terrace ? 2 + static_cast<int>(random.index(5)) : 1 + static_cast<int>(random.index(3));
  shape.storey_height = random.uniform(2.8, 3.4);
  shape.has_shop = is_terrace && setback < 1.0 && random.chance(0.4);
  double base = -1e9;
  for (const double ds : {0.0, width}) {
    for (const double dd : {setback, setback + shape.depth}) {
      base = std::max(base, town.plan.ground(side.at(s + ds, dd)).z);
    }
  }
  base += kGroundLift + random.uniform(0.03, 0.3);
  // The street is curved, the house is not: its frame is that of the middle of its front.
  const Vec2 middle = side.at(s + 0.5 * width, setback);
  Frame frame = town.plan.level_frame(middle, side.along, kGroundLift);
  shape.ground_drop = base - frame.origin.z;
  frame.origin.z = base;
  frame.origin = frame({-0.5 * width, 0, 0});
  add_house(town.mesh, frame, shape, random);

  if (setback > 1.6) {
    const Boundary kind = random_boundary(random);
    const double gate = s + random.uniform(0.3, 0.7) * width;
    if (kind != Boundary::kNone) {
      add_boundary(town, side, s, s + width, 0.25, kind, gate, random);
    }
    const std::uint32_t bushes = 1 + random.index(6);
    for (std::uint32_t i = 0; i < bushes; ++i) {
      const Vec2 at =
          side.at(s + random.uniform(0.6, width - 0.6), random.uniform(0.9, setback - 0.5));
      add_instance(town, town.prototypes.bushes, random.index(6), at, side.along,
                   random.uniform(0, 6.28), random.uniform(0.6, 1.1));
    }
    if (setback > 3.2 && random.chance(0.7)) {
      const Vec2 at = side.at(s + random.uniform(1.5, width - 1.5), 0.5 * setback);
      add_instance(town, town.prototypes.trees, random.index(14), at, side.along,
                   random.uniform(0, 6.28), random.uniform(0.45, 0.8));
    }
  }
}

void add_built_side(Town& town, const BlockSide& side, Random& random) {
  const bool is_terrace = random.chance(0.35);
  const double setback_base = is_terrace ? random.uniform(0.3, 1.2) : random.uniform(3.0, 6.5);
  double s = random.uniform(0.3, 1.5);
  const double end = side.length - kCornerReserve;
  while (s + 8.0 < end) {
    const double width = std::min(random.uniform(8.0, is_terrace ? 20.0 : 14.0), end - s);
    const double setback = setback_base + (is_terrace ? 0.0 : random.uniform(-0.5, 0.5));
    add_lot(town, side, s, width, setback, is_terrace, random);
    s += width;
    const bool has_gap = !is_terrace || random.chance(0.18);
    if (!has_gap) continue;
    const double gap = random.uniform(2.5, 6.0);
    if (random.chance(0.6)) {
      const Vec2 at = side.at(s + 0.5 * gap, random.uniform(3.5, 9.0));
      add_instance(town, town.prototypes.trees, random.index(14), at, side.along,
                   random.uniform(0, 6.28), random.uniform(0.5, 0.85));
    }
    const Boundary kind = random_boundary(random);
    if (kind != Boundary::kNone && s + gap < end) {
      add_boundary(town, side, s, s + gap, setback_base + 1.0, kind, -1e9, random);
    }
    s += gap;
  }
}

void add_yard(Town& town, Vec2 low, Vec2 high, Random& random) {
  const std::uint32_t trees = 4 + random.index(6);
  for (std::uint32_t i = 0; i < trees + 8; ++i) {
    const Vec2 at{random.uniform(low.x + 17, high.x - 17), random.uniform(low.y + 17, high.y - 17)};
    const bool is_tree = i < trees;
    add_instance(town, is_tree ? town.prototypes.trees : town.prototypes.bushes, random.index(14),
                 at, {1, 0}, random.uniform(0, 6.28), random.uniform(0.7, 1.1));
  }
}

void add_park(Town& town, Vec2 low, Vec2 high, Random& random) {
  for (int i = 0; i < 46; ++i) {
    const Vec2 at{random.uniform(low.x + 2, high.x - 2), random.uniform(low.y + 2, high.y - 2)};
    add_instance(town, town.prototypes.trees, random.index(14), at, {1, 0}, random.uniform(0, 6.28),
                 random.uniform(0.7, 1.15));
  }
  for (int i = 0; i < 50; ++i) {
    const Vec2 at{random.uniform(low.x + 1, high.x - 1), random.uniform(low.y + 1, high.y - 1)};
    add_instance(town, town.prototypes.bushes, random.index(6), at, {1, 0}, random.uniform(0, 6.28),
                 random.uniform(0.7, 1.4));
  }
  for (int i = 0; i < 6; ++i) {
    const Vec2 at{random.uniform(low.x + 4, high.x - 4), random.uniform(low.y + 4, high.y - 4)};
    add_instance(town, town.prototypes.benches, 0, at, {1, 0}, random.uniform(0, 6.28), 1.0);
  }
}

void add_square(Town& town, Vec2 low, Vec2 high, Random& random) {
  for (double u = low.x + 4; u < high.x - 4; u += 9.0) {
    for (const double v : {low.y + 2.0, high.y - 2.0}) {
      if (random.chance(0.75)) {
        add_instance(town, town.prototypes.trees, random.index(11), {u, v}, {1, 0},
                     random.uniform(0, 6.28), random.uniform(0.6, 0.9));
      }
    }
  }
  HouseShape hall{22.0, 16.0, 4.2, 0.3, 2, true};
  const Vec2 centre = 0.5 * (low + high);
  Frame frame = town.plan.level_frame(centre, {1, 0}, kGroundLift + 0.45);
  frame.origin = frame({-11.0, -8.0, 0.0});
  add_house(town.mesh, frame, hall, random);
}

/// Woods and a fence beyond the outermost streets.
void add_outskirts(Town& town, Random& random) {
  const int last = TownPlan::kLines - 1;
  const Vec2 low{town.plan.line_u(0), town.plan.line_v(0)};
  const Vec2 high{town.plan.line_u(last), town.plan.line_v(last)};
  for (int i = 0; i < 700; ++i) {
    const double out = 9.0 + 60.0 * random.uniform() * random.uniform();
    const double along = random.uniform();
    const std::uint32_t side = random.index(4);
    Vec2 at{low.x - out + along * (high.x - low.x + 2 * out), low.y - out};
    if (side == 1) at.y = high.y + out;
    if (side >= 2) {
      at = {side == 2 ? low.x - out : high.x + out,
            low.y - out + along * (high.y - low.y + 2 * out)};
    }
    add_instance(town, town.prototypes.trees, random.index(14), at, {1, 0}, random.uniform(0, 6.28),
                 random.uniform(0.8, 1.3));
  }
}

}  // namespace

BlockKind block_kind(std::uint64_t seed, int column, int row) {
  const double draw =
      Random(seed, Stream::kBlock, static_cast<std::uint64_t>(column * 16 + row), 5).uniform();
  if (draw < 0.81) return BlockKind::kBuilt;
  return draw < 0.93 ? BlockKind::kPark : BlockKind::kPlaza;
}

void add_blocks(std::uint64_t seed, Town& town) {
  const TownPlan& plan = town.plan;
  for (int column = 0; column < TownPlan::kBlocks; ++column) {
    for (int row = 0; row < TownPlan::kBlocks; ++row) {
      Random random(seed, Stream::kBlock, static_cast<std::uint64_t>(column * 16 + row));
      const double e = street::kProperty;
      const Vec2 low{plan.line_u(column) + e, plan.line_v(row) + e};
      const Vec2 high{plan.line_u(column + 1) - e, plan.line_v(row + 1) - e};
      const double du = high.x - low.x;
      const double dv = high.y - low.y;
      switch (block_kind(seed, column, row)) {
        case BlockKind::kPark:
          add_park(town, low, high, random);
          break;
        case BlockKind::kPlaza:
          add_square(town, low, high, random);
          break;
        case BlockKind::kBuilt: {
          const BlockSide sides[4] = {{plan, low, {1, 0}, {0, 1}, du},
                                      {plan, {high.x, low.y}, {0, 1}, {-1, 0}, dv},
                                      {plan, high, {-1, 0}, {0, -1}, du},
                                      {plan, {low.x, high.y}, {0, -1}, {1, 0}, dv}};
          for (const BlockSide& side : sides) add_built_side(town, side, random);
          add_yard(town, low, high, random);
          break;
        }
      }
    }
  }
  Random random(seed, Stream::kBlock, 4096);
  add_outskirts(town, random);
}

}  // namespace unimapper::simulator
