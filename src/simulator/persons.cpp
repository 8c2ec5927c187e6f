// Prototypes of persons and cyclists.
//
// A person's torso has its origin on the ground between the feet; a leg hangs from the hip and an
// arm from the shoulder at their own origins, so that they can swing. x is forward.
#include "person_shape.hpp"
#include "random.hpp"
#include "world.hpp"

namespace unimapper::simulator {
namespace {

Mesh make_torso(Surface cloth, bool has_backpack) {
  Mesh mesh;
  mesh.tube({0, 0, 0.82}, {0, 0, 1.1}, 0.16, 0.15, 8, cloth);
  mesh.tube({0, 0, 1.1}, {0, 0, 1.42}, 0.15, 0.19, 8, cloth);
  mesh.tube({0, 0, 1.42}, {0, 0, 1.52}, 0.19, 0.07, 8, cloth);
  mesh.tube({0.01, 0, 1.5}, {0.02, 0, 1.62}, 0.07, 0.1, 8, Surface::kSkin);
  mesh.tube({0.02, 0, 1.62}, {0.02, 0, 1.76}, 0.1, 0.06, 8, Surface::kSkin);
  mesh.disc({0.02, 0, 1.76}, {0, 0, 1}, 0.06, 8, Surface::kClothDark);
  if (has_backpack) mesh.box({}, {-0.34, -0.16, 1.0}, {-0.14, 0.16, 1.45}, Surface::kClothDark);
  return mesh;
}

Mesh make_leg(Surface cloth) {
  Mesh mesh;
  mesh.tube({0, 0, 0}, {0.01, 0, -0.45}, 0.09, 0.065, 6, cloth);
  mesh.tube({0.01, 0, -0.45}, {0, 0, -0.82}, 0.065, 0.045, 6, cloth);
  mesh.box({}, {-0.07, -0.045, -0.88}, {0.19, 0.045, -0.8}, Surface::kClothDark);
  return mesh;
}

Mesh make_arm(Surface cloth) {
  Mesh mesh;
  mesh.tube({0, 0, 0}, {0, 0, -0.3}, 0.055, 0.045, 6, cloth);
  mesh.tube({0, 0, -0.3}, {0.06, 0, -0.58}, 0.045, 0.04, 6, Surface::kSkin);
  return mesh;
}

void add_bicycle(Mesh& mesh) {
  constexpr double kWheel = 0.34;
  for (const double x : {-0.53, 0.53}) {
    constexpr int kSpokes = 12;
    for (int i = 0; i < kSpokes; ++i) {
      const double a = 2.0 * kPi * i / kSpokes;
      const double b = 2.0 * kPi * (i + 1) / kSpokes;
      const Vec3 hub{x, 0, kWheel};
      const Vec3 rim_a{x + kWheel * std::cos(a), 0, kWheel + kWheel * std::sin(a)};
      const Vec3 rim_b{x + kWheel * std::cos(b), 0, kWheel + kWheel * std::sin(b)};
      mesh.tube(rim_a, rim_b, 0.025, 0.025, 4, Surface::kTyre);
      if (i % 2 == 0) mesh.tube(hub, rim_a, 0.006, 0.004, 3, Surface::kBikeFrame);
    }
  }
  const Vec3 rear{-0.53, 0, kWheel};
  const Vec3 front{0.53, 0, kWheel};
  const Vec3 pedals{-0.08, 0, 0.28};
  const Vec3 seat{-0.25, 0, 0.9};
  const Vec3 head{0.4, 0, 0.85};
  const Vec3 tubes[][2] = {{rear, pedals}, {rear, seat},   {pedals, seat},
                           {seat, head},   {pedals, head}, {head, front}};
  for (const auto& t : tubes) mesh.tube(t[0], t[1], 0.022, 0.022, 5, Surface::kBikeFrame);
  mesh.tube(head, {0.38, 0, 1.02}, 0.02, 0.02, 5, Surface::kBikeFrame);
  mesh.tube({0.38, -0.28, 1.02}, {0.38, 0.28, 1.02}, 0.018, 0.018, 5, Surface::kBikeFrame);
  mesh.box({}, {-0.38, -0.08, 0.9}, {-0.12, 0.08, 0.96}, Surface::kCarTrim);
}

Mesh make_cyclist(Surface cloth) {
  Mesh mesh;
  add_bicycle(mesh);
  const Vec3 hip{-0.22, 0, 0.98};
  const Vec3 shoulder{0.1, 0, 1.48};
  mesh.tube(hip, shoulder, 0.15, 0.18, 8, cloth);
  mesh.tube(shoulder, shoulder + Vec3{0.06, 0, 0.12}, 0.07, 0.07, 6, Surface::kSkin);
  mesh.tube(shoulder + Vec3{0.06, 0, 0.1}, shoulder + Vec3{0.12, 0, 0.34}, 0.1, 0.08, 8,
            Surface::kClothLight);
  for (const double side : {-1.0, 1.0}) {
    const Vec3 out{0, 0.1 * side, 0};
    const Vec3 knee = Vec3{0.16, 0.12 * side, side > 0 ? 0.85 : 0.68};
    const Vec3 foot = Vec3{-0.05, 0.12 * side, side > 0 ? 0.45 : 0.14};
    mesh.tube(hip + out, knee, 0.09, 0.06, 6, Surface::kClothDark);
    mesh.tube(knee, foot, 0.06, 0.045, 6, Surface::kClothDark);
    mesh.tube(shoulder + 1.5 * out, {0.38, 0.24 * side, 1.04}, 0.05, 0.04, 6, cloth);
  }
  return mesh;
}

}  // namespace

void add_person_prototypes(Prototypes& prototypes) {
  auto& meshes = prototypes.meshes;
  const auto next = [&] { return static_cast<std::uint32_t>(meshes.size()); };
  prototypes.torsos = {next(), 3};
  meshes.push_back(make_torso(Surface::kClothLight, false));
  meshes.push_back(make_torso(Surface::kClothDark, true));
  meshes.push_back(make_torso(Surface::kClothDark, false));
  prototypes.legs = {next(), 2};
  meshes.push_back(make_leg(Surface::kClothDark));
  meshes.push_back(make_leg(Surface::kClothLight));
  prototypes.arms = {next(), 2};
  meshes.push_back(make_arm(Surface::kClothLight));
  meshes.push_back(make_arm(Surface::kClothDark));
  prototypes.cyclists = {next(), 2};
  meshes.push_back(make_cyclist(Surface::kClothLight));
  meshes.push_back(make_cyclist(Surface::kClothDark));
  prototypes.bicycles = {next(), 1};
  meshes.emplace_back();
  add_bicycle(meshes.back());
}

}  // namespace unimapper::simulator
