// Files of known positions, as `unimapper map positions` reads them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::apps {

/// Origin of a local east-north-up frame on the ellipsoid WGS84.
struct Datum {
  double latitude_deg = 0.0;   ///< [-90, 90]
  double longitude_deg = 0.0;  ///< [-180, 180]
  double height_m = 0.0;       ///< above the ellipsoid
};

/// East, north and up of a place on WGS84 in the frame of a datum, metres; closed formulas.
[[nodiscard]] Eigen::Vector3d east_north_up(const Datum& place, const Datum& datum);

/// One line of a file.
struct PositionRow {
  std::size_t line = 0;                                ///< from 1
  std::optional<std::uint32_t> sequence;               ///< of the keyframe; none: `stamp_ns` counts
  std::int64_t stamp_ns = 0;                           ///< by the session's clock
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< metres; x and y are 0 of a height
  std::optional<double> sigma_xy_m;                    ///< none: only the height is known
  double sigma_z_m = 0.0;
  std::optional<Eigen::Vector3d> lever;  ///< the point in the sensor's frame, metres
};

/// A place in the site frame, metres.
using ToSite = std::function<Eigen::Vector3d(const Datum& place)>;

/// Parses lines "KEY,x,y,z,sigma_xy,sigma_z", "KEY,z,sigma_z" or
/// "KEY,latitude,longitude,height,sigma_xy,sigma_z", KEY being keyframe or stamp, all with or
/// without ",lever_x,lever_y,lever_z", below a line with these names. Lines that are blank or begin
/// with # are left out. Throws std::runtime_error with `file` and line: what is no such line, a
/// number that is none or out of range, a key that is there twice, no line at all, degrees without
/// `to_site` or `datum`, and `datum` without degrees. Degrees go by `to_site`, where there is one.
[[nodiscard]] std::vector<PositionRow> parse_positions(std::string_view text,
                                                       const std::string& file,
                                                       const std::optional<Datum>& datum,
                                                       const ToSite& to_site = {});

/// In a run folder: positions of its recording.
inline constexpr const char* kPositionsFile = "positions.csv";

/// Positions as lines that `parse_positions` reads; of several with one stamp the first one.
[[nodiscard]] std::string format_positions(const std::vector<datasets::Fix>& fixes);

}  // namespace unimapper::apps
