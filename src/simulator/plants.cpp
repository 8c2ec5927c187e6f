// Prototypes of trees, bushes and hedges; single leaves, so that beams pass between them.
#include "random.hpp"
#include "world.hpp"

namespace unimapper::simulator {
namespace {

Vec3 random_direction(Random& random) {
  const double z = random.uniform(-1.0, 1.0);
  const double angle = random.uniform(0.0, 2.0 * kPi);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

void add_leaf(Mesh& mesh, Vec3 at, double size, Random& random) {
  const Vec3 a = random_direction(random);
  const Vec3 b = normalized(cross(a, random_direction(random)));
  mesh.triangle(at + (0.6 * size) * a, at - (0.4 * size) * a + (0.35 * size) * b,
                at - (0.4 * size) * a - (0.35 * size) * b, Surface::kLeaf);
}

/// Leaves in an ellipsoid, denser towards its surface.
void add_blob(Mesh& mesh, Vec3 centre, Vec3 radii, int leaves, double leaf_size, Random& random) {
  for (int i = 0; i < leaves; ++i) {
    const double r = std::pow(random.uniform(), 0.22);
    const Vec3 d = random_direction(random);
    add_leaf(mesh, centre + Vec3{r * radii.x * d.x, r * radii.y * d.y, r * radii.z * d.z},
             leaf_size * random.uniform(0.7, 1.3), random);
  }
}

Mesh make_tree(Random& random) {
  Mesh mesh;
  const double height = random.uniform(5.0, 10.5);
  const double fork = random.uniform(0.26, 0.36) * height;
  const double radius = 0.016 * height + random.uniform(0.02, 0.06);
  const Vec3 lean{random.uniform(-0.25, 0.25), random.uniform(-0.25, 0.25), fork};
  mesh.tube({0, 0, -0.4}, 0.35 * lean, 1.25 * radius, radius, 8, Surface::kBark);
  mesh.tube(0.35 * lean, lean, radius, 0.85 * radius, 8, Surface::kBark);
  const double crown = random.uniform(0.2, 0.28) * height;
  const int boughs = 4 + static_cast<int>(random.index(3));
  for (int i = 0; i < boughs; ++i) {
    const double angle = 2.0 * kPi * (i + random.uniform(0.0, 0.7)) / boughs;
    const double reach = crown * random.uniform(0.5, 0.95);
    const Vec3 tip{lean.x + reach * std::cos(angle), lean.y + reach * std::sin(angle),
                   height * random.uniform(0.55, 0.82)};
    mesh.tube(lean, tip, 0.55 * radius, 0.2 * radius, 5, Surface::kBark);
    const double blob = crown * random.uniform(0.6, 0.85);
    add_blob(mesh, tip, {blob, blob, 0.75 * blob}, 330, 0.24, random);
  }
  const Vec3 top{lean.x, lean.y, 0.86 * height};
  mesh.tube(lean, top, 0.7 * radius, 0.15 * radius, 5, Surface::kBark);
  add_blob(mesh, top, {0.8 * crown, 0.8 * crown, 0.13 * height}, 360, 0.24, random);
  return mesh;
}

Mesh make_conifer(Random& random) {
  Mesh mesh;
  const double height = random.uniform(6.0, 11.0);
  mesh.tube({0, 0, -0.4}, {0, 0, height}, 0.16, 0.02, 6, Surface::kBark);
  for (int i = 0; i < 1700; ++i) {
    const double w = std::sqrt(random.uniform());  // more needles where the cone is wide
    const double z = height * (1.0 - 0.88 * w);
    const double r = 0.24 * (height - z) * std::pow(random.uniform(), 0.3) + 0.05;
    const double angle = random.uniform(0.0, 2.0 * kPi);
    add_leaf(mesh, {r * std::cos(angle), r * std::sin(angle), z - 0.25 * r}, 0.26, random);
  }
  return mesh;
}

Mesh make_bush(Random& random) {
  Mesh mesh;
  const int blobs = 2 + static_cast<int>(random.index(3));
  for (int i = 0; i < blobs; ++i) {
    const double r = random.uniform(0.35, 0.65);
    const Vec3 at{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0.7 * r};
    add_blob(mesh, at, {r, r, 0.9 * r}, 170, 0.13, random);
  }
  for (int i = 0; i < 5; ++i) {
    mesh.tube({0, 0, -0.2}, {random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), 0.6}, 0.02, 0.01,
              4, Surface::kBark);
  }
  return mesh;
}

/// Two metres of hedge along x.
Mesh make_hedge(Random& random) {
  Mesh mesh;
  const double height = random.uniform(1.0, 1.5);
  mesh.box({}, {-1.0, -0.16, -0.4}, {1.0, 0.16, height - 0.16}, Surface::kHedgeCore);
  for (int i = 0; i < 420; ++i) {
    const double x = random.uniform(-1.0, 1.0);
    const bool is_top = random.chance(0.25);
    const double side = random.chance(0.5) ? 1.0 : -1.0;
    const Vec3 at = is_top
                        ? Vec3{x, random.uniform(-0.28, 0.28), height - random.uniform(0.0, 0.15)}
                        : Vec3{x, side * random.uniform(0.18, 0.32), random.uniform(0, height)};
    add_leaf(mesh, at, 0.12, random);
  }
  return mesh;
}

}  // namespace

void add_plant_prototypes(std::uint64_t seed, Prototypes& prototypes) {
  Random random(seed, Stream::kPrototype);
  const auto add = [&](PrototypeRange& range, std::uint32_t count, auto make) {
    range = {static_cast<std::uint32_t>(prototypes.meshes.size()), count};
    for (std::uint32_t i = 0; i < count; ++i) prototypes.meshes.push_back(make(i));
  };
  add(prototypes.trees, 14,
      [&](std::uint32_t i) { return i < 11 ? make_tree(random) : make_conifer(random); });
  add(prototypes.bushes, 6, [&](std::uint32_t) { return make_bush(random); });
  add(prototypes.hedges, 3, [&](std::uint32_t) { return make_hedge(random); });
}

}  // namespace unimapper::simulator
