// Points of a map in the binary form of the page.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace unimapper::apps {

/// A point that the page shows.
struct ViewPoint {
  Eigen::Vector3f position;    ///< metres
  std::uint8_t session = 0;    ///< index of the session; 255: that or a later one
  std::uint8_t category = 0;   ///< by layer: docs/api.md
  std::uint8_t intensity = 0;  ///< from 1; 0: not known
};

/// One of them has an intensity.
[[nodiscard]] bool has_intensity(std::span<const ViewPoint> points);

/// "UMPT", version, count, origin and step, then columns of x, y, z (16 bits), session and
/// category, and of intensity where one is known, little-endian (docs/api.md). Points are at most
/// 65535 steps from the origin on each axis. O(points).
[[nodiscard]] std::string point_block(std::span<const ViewPoint> points,
                                      const Eigen::Vector3f& origin, float step_m);

/// gzip, the same bytes for the same input. Throws std::bad_alloc.
[[nodiscard]] std::string gzipped(std::string_view bytes);

}  // namespace unimapper::apps
