// Model of quantisation and sorting that the encoder is tested against.
#pragma once

#include "src/core/quantise.hpp"
#include "src/wire/cell_grid.hpp"
#include "tests/test.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::wire::wire_test {

inline std::vector<FineCell> quantised_cells(std::span<const FineCell> cells, const CellGrid& grid,
                                             std::uint64_t& left_out) {
  // By block of 32 cells, cell, ground first, and part of the cell.
  std::vector<std::pair<std::array<int, 10>, FineCell>> entries;
  for (const FineCell& cell : cells) {
    const auto at = grid.find(cell.position);
    if (!at) {
      ++left_out;
      continue;
    }
    const auto& c = at->cell;
    const std::uint8_t ground = cell.ground != 0 ? 1 : 0;
    entries.push_back({{c[0] / 32, c[1] / 32, c[2] / 32, c[0] % 32, c[1] % 32, c[2] % 32,
                        1 - ground, at->part[0], at->part[1], at->part[2]},
                       {grid.position(*at), 0, ground, 0}});
  }
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FineCell> quantised;
  for (const auto& [key, cell] : entries) quantised.push_back(cell);
  return quantised;
}

/// Puts everything on the grid of the wire and removes and counts what is beyond it.
inline void quantise(KeyframeRecord& record) {
  const double cell_mm = std::round(1000.0 * static_cast<double>(record.cell_size_m));
  const CellGrid grid(record.T_odometry_keyframe, cell_mm / 1000.0);
  record.cell_size_m = static_cast<float>(cell_mm) / 1000.0F;
  record.static_cells = quantised_cells(record.static_cells, grid, record.left_out);
  record.dynamic_cells = quantised_cells(record.dynamic_cells, grid, record.left_out);
  record.left_out += std::erase_if(record.keypoints, [](Keypoint& keypoint) {
    const auto millimetres = to_millimetres(keypoint.position);
    const auto normal = octahedral(keypoint.normal);
    if (!millimetres || !normal) return true;
    keypoint.position = from_millimetres(*millimetres);
    keypoint.normal = unit_vector(*normal);
    return false;
  });
  record.left_out += std::erase_if(record.planes, [](PlanePatch& plane) {
    const auto centimetres = to_centimetres(plane.center);
    const auto normal = octahedral(plane.normal);
    if (!centimetres || !normal) return true;
    plane.center = from_centimetres(*centimetres);
    plane.normal = unit_vector(*normal);
    return false;
  });
}

}  // namespace unimapper::wire::wire_test
