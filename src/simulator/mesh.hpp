// Triangle mesh with one material per triangle, and primitive solids.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry.hpp"
#include "surface.hpp"

namespace unimapper::simulator {

struct Mesh {
  std::vector<float> positions;        ///< x y z per vertex, metres
  std::vector<std::uint32_t> indices;  ///< three per triangle
  std::vector<Surface> surfaces;       ///< one per triangle

  [[nodiscard]] std::size_t triangle_count() const { return surfaces.size(); }

  std::uint32_t vertex(Vec3 p);
  void triangle(Vec3 a, Vec3 b, Vec3 c, Surface surface);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, Surface surface);
  /// Corners in order around the outline.
  void quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d, Surface surface);
  /// Axis-aligned in `frame`, between two opposite corners.
  void box(const Frame& frame, Vec3 low, Vec3 high, Surface surface);
  /// Between two points, radii at either end, `sides` faces; ends open.
  void tube(Vec3 from, Vec3 to, double radius_from, double radius_to, int sides, Surface surface);
  /// Closes a ring of vertices around `axis` (a wheel, the top of a bin).
  void disc(Vec3 centre, Vec3 axis, double radius, int sides, Surface surface);
};

}  // namespace unimapper::simulator
