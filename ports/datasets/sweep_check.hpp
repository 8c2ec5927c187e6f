// Test of whether compensating the motion within sweeps makes scans sharper.
#pragma once

#include <string>
#include <string_view>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/sensor_motion.hpp"

namespace unimapper::datasets {

/// What the times of the points turned out to be.
enum class SweepFinding : std::uint8_t {
  kSharper,      ///< compensating the motion makes surfaces thinner
  kNoTimes,      ///< the recording has no time per point
  kNoMotion,     ///< too little motion within sweeps to tell, or to matter
  kUnclear,      ///< wrong readings of the times help as much: the surroundings do not tell
  kCompensated,  ///< thinnest as recorded: the motion is compensated already
  kReversed,     ///< thinnest with the times running backwards
  kOtherEnd,     ///< thinnest with the stamp at the other end of the sweep
};

/// Outcome of the test.
struct SweepCheck {
  /// What the surfaces say.
  SweepFinding finding = SweepFinding::kNoTimes;
  /// Thickness of surfaces with the motion compensated, as a share of that without; 0: not
  /// measured.
  double compensated = 0.0;
  /// Thickness of surfaces with the best other reading of the times, as a share of that
  /// uncompensated; 0: not measured.
  double best_other = 0.0;
  std::size_t scans = 0;  ///< compared

  /// The finding in words, without a final stop.
  [[nodiscard]] std::string text() const;
};

/// Compares about 30 scans where the sensor moves most: as recorded, compensated, with the times
/// running backwards, and with stamps of the other end of the sweep. Reads those scans only.
/// Throws DatasetError.
[[nodiscard]] SweepCheck check_sweeps(const Dataset& dataset, const SensorMotion& poses);

}  // namespace unimapper::datasets
