// Sensor of a recording, recognised from its points
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/input/axes.hpp"
#include "src/input/finding.hpp"
#include "src/input/ranges.hpp"
#include "src/input/sensor_sheets.hpp"

namespace unimapper::input {

/// What the points of some scans say of their sensor.
struct SensorFigures {
  std::size_t points = 0;           ///< of the fullest scan, each place once
  std::size_t recorded_points = 0;  ///< of the fullest scan, all
  double copies = 1.0;              ///< how often the points of a scan are there, on average
  double lowest_deg = 0.0;          ///< elevation that one ray in two hundred is below
  double highest_deg = 0.0;         ///< elevation that one ray in two hundred is above
  double width_deg = 0.0;           ///< azimuths that hold 98 % of the points
  double farthest_m = 0.0;          ///< that one point in a thousand is beyond
  double ray_spacing_deg = 0.0;     ///< along a ring; 0: no rings were found
  double ring_spacing_deg = 0.0;    ///< from ring to ring
  std::uint32_t rings = 0;          ///< that the points carry; 0: they carry none
  [[nodiscard]] bool has_rings() const { return ring_spacing_deg > 0.0; }
};

/// Measures scans, exact copies of a point left out: a LiDAR that gives the strongest and the last
/// return of each ray gives most points twice. O(points), and about 20 ms.
[[nodiscard]] SensorFigures measure_sensor(std::span<const datasets::Scan> scans,
                                           const DirectionFigures& directions);

/// A data sheet and how far the figures are from it; 0: as stated, above 1: another sensor.
struct SensorMatch {
  const SensorSheet* sheet = nullptr;
  std::uint32_t columns = 0;  ///< the mode that fits best; 0 without rings
  double distance = 0.0;
};

/// How far the figures are from one data sheet.
[[nodiscard]] SensorMatch match_sensor(const SensorFigures& figures, const SensorSheet& sheet);

/// All data sheets (but the generic one), the nearest first; of those that no scan tells apart (the
/// VLP-16 and its likes) the first of the list.
[[nodiscard]] std::vector<SensorMatch> match_sensors(const SensorFigures& figures);

/// True where the first of `matches` is near, and the others are clearly farther away or of the
/// same rings and field of view.
[[nodiscard]] bool is_recognised(const std::vector<SensorMatch>& matches);

/// Whether the elevations are those of a known LiDAR that sees all round, or of one upside down.
[[nodiscard]] SheetSide sheet_side(const SensorFigures& figures);

/// The generic model, widened where the points lie outside its field of view and range or are more
/// than it holds.
[[nodiscard]] SensorModel generic_for(const SensorFigures& figures);

/// A sensor that was named against what the points say.
[[nodiscard]] Finding check_sensor(const SensorFigures& figures, const SensorSheet& named);

}  // namespace unimapper::input
