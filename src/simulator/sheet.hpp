// Ground as a sheet of triangles.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "mesh.hpp"

namespace unimapper::simulator {

/// Regular grid over a rectangle of a plan: `place(plan)` says where a corner lies in the world,
/// `paint(plan)` what a cell is made of.
template <typename Place, typename Paint>
void add_sheet(Mesh& mesh, Vec2 low, Vec2 high, double step, Place place, Paint paint) {
  const int nu = std::max(1, static_cast<int>(std::ceil((high.x - low.x) / step)));
  const int nv = std::max(1, static_cast<int>(std::ceil((high.y - low.y) / step)));
  const auto at = [&](double iu, double iv) {
    return Vec2{low.x + (high.x - low.x) * iu / nu, low.y + (high.y - low.y) * iv / nv};
  };
  const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
  for (int iv = 0; iv <= nv; ++iv) {
    for (int iu = 0; iu <= nu; ++iu) mesh.vertex(place(at(iu, iv)));
  }
  const auto row = static_cast<std::uint32_t>(nu + 1);
  for (int iv = 0; iv < nv; ++iv) {
    for (int iu = 0; iu < nu; ++iu) {
      const std::uint32_t a =
          first + static_cast<std::uint32_t>(iv) * row + static_cast<std::uint32_t>(iu);
      const Surface surface = paint(at(iu + 0.5, iv + 0.5));
      mesh.triangle(a, a + 1, a + row + 1, surface);
      mesh.triangle(a, a + row + 1, a + row, surface);
    }
  }
}

}  // namespace unimapper::simulator
