// Generator of hostile (adversarial) scans that maximise the pipeline's work.
//
// Used by the tests that bound this work.
#pragma once

#include <bit>

#include "src/core/voxel_key.hpp"
#include "tests/test.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::hostile {

enum class Kind : std::uint8_t {
  kOneCell,        ///< all points in one fine cell
  kOwnCells,       ///< every point in a fine cell of its own, never the same one twice
  kCollidingKeys,  ///< tiles whose keys all hash to the same few slots
  kTooMany,        ///< ten times the points a scan may have
  kLine,           ///< all points on one straight line
  kPlane,          ///< all points on one level plane
  kEnormous,       ///< coordinates up to the largest float, and some good ones
  kNotFinite       ///< two of three points NaN or infinite in one coordinate
};
inline constexpr std::array<Kind, 8> kKinds = {
    Kind::kOneCell, Kind::kOwnCells, Kind::kCollidingKeys, Kind::kTooMany,
    Kind::kLine,    Kind::kPlane,    Kind::kEnormous,      Kind::kNotFinite};

[[nodiscard]] constexpr std::string_view name(Kind kind) noexcept {
  constexpr std::array<std::string_view, 8> kNames = {
      "all points in one cell", "every point in its own cell",
      "colliding keys",         "ten times the points",
      "all points on a line",   "all points on a plane",
      "enormous coordinates",   "NaN and infinity"};
  return kNames[static_cast<std::size_t>(kind)];
}

using Points = std::vector<Eigen::Vector3f>;

/// Slots of the directory in which blocks find their tile of 4 x 4 x 4 (at most half full).
[[nodiscard]] inline std::uint64_t slot_count(const PipelineConfig& config) noexcept {
  return std::bit_ceil(std::uint64_t{std::max(config.voxel.max_window_blocks / 4, 64U)} * 2);
}

/// Up to `count` points, one in each tile within range whose key hashes to one of the first
/// `slots` slots, for a sensor at the origin that starts there.
[[nodiscard]] inline Points colliding_points(const PipelineConfig& config, std::size_t count,
                                             std::uint64_t slots) {
  const std::uint64_t mask = slot_count(config) - 1;
  const float size_m = config.voxel.fine_size_m * 16.0F;
  const float range_m = config.keyframe.range_max_m * 0.95F;
  const auto reach = static_cast<std::int32_t>(range_m / size_m);
  Points points;
  for (std::int32_t z = 1; z < reach; ++z) {
    for (std::int32_t y = -reach; y < reach; ++y) {
      for (std::int32_t x = -reach; x < reach; ++x) {
        if ((mix_bits(pack({x, y, z})) & mask) >= slots) continue;
        const Eigen::Vector3f center =
            (Eigen::Vector3i(x, y, z).cast<float>().array() + 0.5F).matrix() * size_m;
        if (center.norm() < range_m) points.push_back(center);
        if (points.size() == count) return points;
      }
    }
  }
  return points;
}

/// Point `i` of a lattice with one point per fine cell, in layers of 500 by 500 cells.
[[nodiscard]] inline Eigen::Vector3f lattice_point(std::size_t i, float size_m) noexcept {
  const auto x = static_cast<float>(i % 500) - 249.5F;
  const auto y = static_cast<float>(i / 500 % 500) - 249.5F;
  const auto z = static_cast<float>(i / 250000) + 5.5F;
  return {x * size_m, y * size_m, z * size_m};
}

/// Scan `scan` of a keyframe, for a sensor that stands at the origin.
[[nodiscard]] inline Points scan(Kind kind, const PipelineConfig& config, std::size_t scan) {
  const std::size_t count = config.keyframe.max_points_per_scan;
  const float far_m = config.keyframe.range_max_m * 0.9F;
  const float near_m = config.keyframe.range_min_m * 1.5F;
  Points points;
  if (kind == Kind::kCollidingKeys) {
    const Points cells = colliding_points(config, count, 64);
    for (std::size_t i = 0; i < count && !cells.empty(); ++i) {
      points.push_back(cells[(i * 7919) % cells.size()]);
    }
    return points;
  }
  const std::size_t total = kind == Kind::kTooMany ? count * 10 : count;
  points.reserve(total);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kLargest = std::numeric_limits<float>::max();
  const auto edge = static_cast<std::size_t>(std::sqrt(static_cast<double>(count))) + 1;
  for (std::size_t i = 0; i < total; ++i) {
    const float share = static_cast<float>(i) / static_cast<float>(total);
    const Eigen::Vector3f good = lattice_point(i % 100000, 0.2F);
    switch (kind) {
      case Kind::kOneCell:
        points.emplace_back(10.05F + 0.1F * share, 0.1F, 1.1F);
        break;
      case Kind::kOwnCells:
        points.push_back(lattice_point(scan * count + i, config.voxel.fine_size_m));
        break;
      case Kind::kLine:
        points.emplace_back(near_m + (far_m - near_m) * share, 0.1F, 0.1F);
        break;
      case Kind::kPlane:
        points.emplace_back(
            far_m * (static_cast<float>(i % edge) / static_cast<float>(edge) - 0.5F),
            far_m * (static_cast<float>(i / edge) / static_cast<float>(edge) - 0.5F), -1.75F);
        break;
      case Kind::kEnormous:
        points.push_back(i % 3 == 0   ? good
                         : i % 3 == 1 ? Eigen::Vector3f(kLargest, -kLargest * share, 1.0F)
                                      : Eigen::Vector3f(1e9F * share, 1e-40F, -1e20F));
        break;
      case Kind::kNotFinite:
        points.push_back(good);
        if (i % 3 != 0) points.back()(static_cast<int>(i / 3 % 3)) = i % 3 == 1 ? kNan : -kInfinity;
        break;
      default:
        points.push_back(good);
    }
  }
  return points;
}

}  // namespace unimapper::hostile
