#include "ports/lcm/quantise.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace unimapper::wire {

namespace {

constexpr double kMaxCode = 32767.0;

/// Rounds to a grid of `steps_per_metre`; nothing if an axis leaves [lowest, highest].
std::optional<Eigen::Vector3i> to_steps(const Eigen::Vector3f& position, double steps_per_metre,
                                        std::int32_t lowest, std::int32_t highest) {
  Eigen::Vector3i steps;
  for (int axis = 0; axis < 3; ++axis) {
    const double rounded = std::floor(static_cast<double>(position[axis]) * steps_per_metre + 0.5);
    // Written so that NaN fails it too.
    if (!(rounded >= lowest && rounded <= highest)) return std::nullopt;
    steps[axis] = static_cast<std::int32_t>(rounded);
  }
  return steps;
}

std::int16_t round_to_code(double value) {
  return static_cast<std::int16_t>(std::floor(value * kMaxCode + 0.5));
}

double sign_of(double value) { return value < 0.0 ? -1.0 : 1.0; }

/// On the rim of the square (c, v) and (c, -v) are the same vector; the positive one is used.
OctahedralNormal canonical(OctahedralNormal code) {
  constexpr std::int16_t kRim = 32767;
  const bool on_u_rim = std::abs(code.u) == kRim;
  const bool on_v_rim = std::abs(code.v) == kRim;
  if (on_u_rim) code.v = static_cast<std::int16_t>(std::abs(code.v));
  if (on_v_rim) code.u = static_cast<std::int16_t>(std::abs(code.u));
  return code;
}

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

std::optional<Eigen::Vector3i> to_millimetres(const Eigen::Vector3f& position) {
  return to_steps(position, 1e3, -kKeypointLimitMm, kKeypointLimitMm);
}

Eigen::Vector3f from_millimetres(const Eigen::Vector3i& millimetres) {
  return (millimetres.cast<double>() * 1e-3).cast<float>();
}

std::optional<Eigen::Vector3i> to_centimetres(const Eigen::Vector3f& position) {
  return to_steps(position, 1e2, std::numeric_limits<std::int16_t>::min(),
                  std::numeric_limits<std::int16_t>::max());
}

Eigen::Vector3f from_centimetres(const Eigen::Vector3i& centimetres) {
  return (centimetres.cast<double>() * 1e-2).cast<float>();
}

std::optional<OctahedralNormal> octahedral(const Eigen::Vector3f& normal) {
  const Eigen::Vector3d n = normal.cast<double>();
  const double sum = n.cwiseAbs().sum();
  if (!std::isfinite(sum) || sum <= 0.0) return std::nullopt;
  double u = n.x() / sum;
  double v = n.y() / sum;
  if (n.z() < 0.0) {
    const double folded_u = (1.0 - std::abs(v)) * sign_of(u);
    v = (1.0 - std::abs(u)) * sign_of(v);
    u = folded_u;
  }
  return canonical({round_to_code(u), round_to_code(v)});
}

Eigen::Vector3f unit_vector(OctahedralNormal code) {
  const double u = code.u / kMaxCode;
  const double v = code.v / kMaxCode;
  // In integers, so that the equator is exactly the equator.
  const int height =
      32767 - std::abs(static_cast<int>(code.u)) - std::abs(static_cast<int>(code.v));
  Eigen::Vector3d n(u, v, height / kMaxCode);
  if (height < 0) {
    n.x() = (1.0 - std::abs(v)) * sign_of(u);
    n.y() = (1.0 - std::abs(u)) * sign_of(v);
  }
  // Not Eigen's normalized(): its vectorised sum of squares may round differently per machine.
  const double length = std::sqrt(n.x() * n.x() + n.y() * n.y() + n.z() * n.z());
  return (n / length).cast<float>();
}

bool is_canonical(OctahedralNormal code) {
  return code.u >= -32767 && code.v >= -32767 && canonical(code) == code;
}

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

void quantise(merge::KeyframeRecord& record) {
  quantise_cells(record.static_cells, record.left_out);
  quantise_cells(record.dynamic_cells, record.left_out);
  record.left_out +=
      std::erase_if(record.keypoints, [](Keypoint& k) { return !quantise_keypoint(k); });
  record.left_out += std::erase_if(record.planes, [](PlanePatch& p) { return !quantise_plane(p); });
}

}  // namespace unimapper::wire
