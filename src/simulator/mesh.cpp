#include "mesh.hpp"

namespace unimapper::simulator {
namespace {

/// Two directions that span the plane across `axis`.
void span_plane(Vec3 axis, Vec3& a, Vec3& b) {
  const Vec3 k = normalized(axis);
  a = normalized(cross(k, std::abs(k.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}));
  b = cross(k, a);
}

}  // namespace

std::uint32_t Mesh::vertex(Vec3 p) {
  positions.push_back(static_cast<float>(p.x));
  positions.push_back(static_cast<float>(p.y));
  positions.push_back(static_cast<float>(p.z));
  return static_cast<std::uint32_t>(positions.size() / 3 - 1);
}

void Mesh::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, Surface surface) {
  indices.insert(indices.end(), {a, b, c});
  surfaces.push_back(surface);
}

void Mesh::triangle(Vec3 a, Vec3 b, Vec3 c, Surface surface) {
  const std::uint32_t first = vertex(a);
  vertex(b);
  vertex(c);
  triangle(first, first + 1, first + 2, surface);
}

void Mesh::quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d, Surface surface) {
  const std::uint32_t first = vertex(a);
  vertex(b);
  vertex(c);
  vertex(d);
  triangle(first, first + 1, first + 2, surface);
  triangle(first, first + 2, first + 3, surface);
}

void Mesh::box(const Frame& frame, Vec3 low, Vec3 high, Surface surface) {
  std::uint32_t corner[8];
  for (int i = 0; i < 8; ++i) {
    corner[i] = vertex(frame({(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                              (i & 4) != 0 ? high.z : low.z}));
  }
  static constexpr int kFaces[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  for (const auto& f : kFaces) {
    triangle(corner[f[0]], corner[f[1]], corner[f[2]], surface);
    triangle(corner[f[0]], corner[f[2]], corner[f[3]], surface);
  }
}

void Mesh::tube(Vec3 from, Vec3 to, double radius_from, double radius_to, int sides,
                Surface surface) {
  Vec3 a;
  Vec3 b;
  span_plane(to - from, a, b);
  const auto first = static_cast<std::uint32_t>(positions.size() / 3);
  for (int i = 0; i < sides; ++i) {
    const double angle = 2.0 * kPi * i / sides;
    const Vec3 direction = std::cos(angle) * a + std::sin(angle) * b;
    vertex(from + radius_from * direction);
    vertex(to + radius_to * direction);
  }
  for (int i = 0; i < sides; ++i) {
    const std::uint32_t low = first + 2 * static_cast<std::uint32_t>(i);
    const std::uint32_t next = first + 2 * static_cast<std::uint32_t>((i + 1) % sides);
    triangle(low, next, next + 1, surface);
    triangle(low, next + 1, low + 1, surface);
  }
}

void Mesh::disc(Vec3 centre, Vec3 axis, double radius, int sides, Surface surface) {
  Vec3 a;
  Vec3 b;
  span_plane(axis, a, b);
  const std::uint32_t middle = vertex(centre);
  for (int i = 0; i < sides; ++i) {
    const double angle = 2.0 * kPi * i / sides;
    vertex(centre + radius * (std::cos(angle) * a + std::sin(angle) * b));
  }
  for (int i = 0; i < sides; ++i) {
    const auto at = static_cast<std::uint32_t>(i);
    const auto next = static_cast<std::uint32_t>((i + 1) % sides);
    triangle(middle, middle + 1 + at, middle + 1 + next, surface);
  }
}

}  // namespace unimapper::simulator
