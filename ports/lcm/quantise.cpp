#include "ports/lcm/quantise.hpp"

#include <algorithm>

namespace unimapper::wire {

namespace {

std::uint64_t block_bits(std::int32_t centimetres) {
  return static_cast<std::uint64_t>((centimetres + 32768) >> 8);
}

std::uint64_t offset_bits(std::int32_t centimetres) {
  return static_cast<std::uint64_t>((centimetres + 32768) & 0xFF);
}

void quantise_cells(std::vector<FineCell>& cells, std::uint64_t& left_out) {
  const std::vector<CellKey> keys = cell_keys(cells, left_out);
  cells.resize(keys.size());
  std::transform(keys.begin(), keys.end(), cells.begin(), cell_of);
}

/// False if the keypoint cannot travel.
bool quantise_keypoint(Keypoint& keypoint) {
  const auto millimetres = to_millimetres(keypoint.position);
  const auto normal = octahedral(keypoint.normal);
  if (!millimetres || !normal) return false;
  keypoint.position = from_millimetres(*millimetres);
  keypoint.normal = unit_vector(*normal);
  return true;
}

/// False if the plane cannot travel.
bool quantise_plane(PlanePatch& plane) {
  const auto centimetres = to_centimetres(plane.center);
  const auto normal = octahedral(plane.normal);
  if (!centimetres || !normal) return false;
  plane.center = from_centimetres(*centimetres);
  plane.normal = unit_vector(*normal);
  return true;
}

}  // namespace

std::vector<CellKey> cell_keys(std::span<const FineCell> cells, std::uint64_t& left_out) {
  std::vector<CellKey> keys;
  keys.reserve(cells.size());
  for (const FineCell& cell : cells) {
    const auto steps = to_centimetres(cell.position);
    if (!steps) {
      ++left_out;
      continue;
    }
    CellKey key = 0;
    for (int axis = 0; axis < 3; ++axis) key = (key << 8U) | block_bits((*steps)[axis]);
    key = (key << 1U) | (cell.ground != 0 ? 0U : 1U);
    for (int axis = 0; axis < 3; ++axis) key = (key << 8U) | offset_bits((*steps)[axis]);
    keys.push_back((key << 8U) | std::min<std::uint16_t>(cell.points, 255));
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

FineCell cell_of(CellKey key) {
  Eigen::Vector3i steps;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto block = static_cast<std::int32_t>((key >> (49U - 8U * axis)) & 0xFFU);
    const auto offset = static_cast<std::int32_t>((key >> (24U - 8U * axis)) & 0xFFU);
    steps[axis] = (block << 8) + offset - 32768;
  }
  FineCell cell{};
  cell.position = from_centimetres(steps);
  cell.points = static_cast<std::uint16_t>(key & 0xFFU);
  cell.ground = ((key >> 32U) & 1U) == 0 ? 1 : 0;
  return cell;
}

void quantise(KeyframeRecord& record) {
  quantise_cells(record.static_cells, record.left_out);
  quantise_cells(record.dynamic_cells, record.left_out);
  record.left_out +=
      std::erase_if(record.keypoints, [](Keypoint& k) { return !quantise_keypoint(k); });
  record.left_out += std::erase_if(record.planes, [](PlanePatch& p) { return !quantise_plane(p); });
}

}  // namespace unimapper::wire
