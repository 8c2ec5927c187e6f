// Model of quantisation and sorting that the encoder is tested against.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "unimapper/core/image_code.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/core/quantise.hpp"

namespace unimapper::wire::wire_test {

inline std::vector<FineCell> quantised_cells(std::span<const FineCell> cells,
                                             std::uint64_t& left_out) {
  struct Entry {
    Eigen::Vector3i block;
    Eigen::Vector3i offset;
    bool ground;
    int points;
  };
  std::vector<Entry> entries;
  for (const FineCell& cell : cells) {
    const auto steps = to_centimetres(cell.position);
    if (!steps) {
      ++left_out;
      continue;
    }
    const Eigen::Vector3i shifted = steps->array() + 32768;
    entries.push_back({shifted / 256, shifted.unaryExpr([](int a) { return a % 256; }),
                       cell.ground != 0, std::min<int>(cell.points, 255)});
  }
  const auto key = [](const Entry& e) {
    return std::array<int, 8>{e.block.x(),  e.block.y(),  e.block.z(),  e.ground ? 0 : 1,
                              e.offset.x(), e.offset.y(), e.offset.z(), e.points};
  };
  std::sort(entries.begin(), entries.end(),
            [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  std::vector<FineCell> quantised;
  for (const Entry& e : entries) {
    const Eigen::Vector3i steps = (e.block * 256 + e.offset).array() - 32768;
    quantised.push_back({from_centimetres(steps), static_cast<std::uint16_t>(e.points),
                         static_cast<std::uint8_t>(e.ground), 0});
  }
  return quantised;
}

/// Puts everything on the grid of the wire and removes and counts what is beyond it.
inline void quantise(KeyframeRecord& record) {
  record.static_cells = quantised_cells(record.static_cells, record.left_out);
  record.dynamic_cells = quantised_cells(record.dynamic_cells, record.left_out);
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
