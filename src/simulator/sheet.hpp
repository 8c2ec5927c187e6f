// Triangulated ground surface over a regular grid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "mesh.hpp"

namespace unimapper::simulator {

/// Regular grid over a rectangle of a plan: `to_world(plan)` returns the world position of a
/// corner, `surface_of(plan)` the material of a cell.
template <typename ToWorld, typename SurfaceOf>
void add_sheet(Mesh& mesh, Vec2 low, Vec2 high, double step, ToWorld to_world,
               SurfaceOf surface_of) {
  const int nu = std::max(1, static_cast<int>(std::ceil((high.x - low.x) / step)));
  const int nv = std::max(1, static_cast<int>(std::ceil((high.y - low.y) / step)));
  const auto at = [&](double iu, double iv) {
    return Vec2{low.x + (high.x - low.x) * iu / nu, low.y + (high.y - low.y) * iv / nv};
  };
  const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
  for (int iv = 0; iv <= nv; ++iv) {
    for (int iu = 0; iu <= nu; ++iu) mesh.vertex(to_world(at(iu, iv)));
  }
  const auto row = static_cast<std::uint32_t>(nu + 1);
  for (int iv = 0; iv < nv; ++iv) {
    for (int iu = 0; iu < nu; ++iu) {
      const std::uint32_t a =
          first + static_cast<std::uint32_t>(iv) * row + static_cast<std::uint32_t>(iu);
      const Surface surface = surface_of(at(iu + 0.5, iv + 0.5));
      mesh.triangle(a, a + 1, a + row + 1, surface);
      mesh.triangle(a, a + row + 1, a + row, surface);
    }
  }
}

}  // namespace unimapper::simulator
