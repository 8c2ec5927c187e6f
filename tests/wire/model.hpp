// Model of quantisation and sorting that the encoder is tested against.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "src/wire/cell_grid.hpp"
#include "unimapper/core/image_code.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/core/quantise.hpp"

namespace unimapper::wire::wire_test {

inline std::vector<FineCell> quantised_cells(std::span<const FineCell> cells, const CellGrid& grid,
                                             std::uint64_t& left_out) {
  struct Entry {
    GridPosition at;
    bool ground;
  };
  std::vector<Entry> entries;
  for (const FineCell& cell : cells) {
    const auto at = grid.find(cell.position);
    if (at) {
      entries.push_back({*at, cell.ground != 0});
    } else {
      ++left_out;
    }
  }
  const auto key = [](const Entry& e) {
    const auto& c = e.at.cell;
    return std::array<int, 10>{c[0] / 32,    c[1] / 32,   c[2] / 32,        c[0] % 32,
                               c[1] % 32,    c[2] % 32,   e.ground ? 0 : 1, e.at.part[0],
                               e.at.part[1], e.at.part[2]};
  };
  std::sort(entries.begin(), entries.end(),
            [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  std::vector<FineCell> quantised;
  for (const Entry& e : entries) {
    quantised.push_back({grid.position(e.at), 0, static_cast<std::uint8_t>(e.ground), 0});
  }
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

/// The record the base gets of a keyframe that a robot encodes.
inline KeyframeRecord sent_record(const KeyframeContent& keyframe, const SessionId& session) {
  KeyframeRecord record;
  record.session = session;
  record.sequence = keyframe.sequence;
  record.reference_scan = keyframe.reference_scan;
  record.T_odometry_keyframe = keyframe.T_odometry_keyframe;
  record.up = keyframe.up;
  record.scans.assign(keyframe.scans.begin(), keyframe.scans.end());
  record.cell_size_m = keyframe.cell_size_m;
  record.static_cells.assign(keyframe.static_cells.begin(), keyframe.static_cells.end());
  record.dynamic_cells.assign(keyframe.dynamic_cells.begin(), keyframe.dynamic_cells.end());
  record.keypoints.assign(keyframe.place.keypoints.begin(), keyframe.place.keypoints.end());
  if (!keyframe.images.empty()) {
    record.image_shape = keyframe.image_shape;
    record.image_full_weight_range_m = keyframe.image_full_weight_range_m;
  }
  for (const FreeSpaceImage& image : keyframe.images) {
    std::vector<std::uint8_t> code(max_image_code(image.pixels.size()));
    code.resize(encode_image(image.pixels, code));
    record.images.push_back({image.scan, code});
  }
  record.points_in = keyframe.points_in;
  record.points_dynamic = keyframe.points_dynamic;
  quantise(record);
  return record;
}

}  // namespace unimapper::wire::wire_test
