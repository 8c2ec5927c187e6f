// Test of whether compensating the motion within sweeps makes scans sharper.
#pragma once

#include <functional>
#include <memory>
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

/// A recording with poses that were found with the times of its points, and without.
struct BothReadings {
  std::unique_ptr<Dataset> with_times;     ///< found from compensated points
  std::unique_ptr<Dataset> without_times;  ///< found from points as recorded
};

/// Whether scans as recorded, with poses found without the times of points, are clearly sharper
/// than compensated, by either poses. Compares about 30 scans where the sensor moves most by the
/// poses of `dataset`: `read` gives poses to those from a scan to before another. False where few
/// have times. Throws DatasetError.
[[nodiscard]] bool is_sharper_without_times(
    const Dataset& dataset,
    const std::function<BothReadings(std::size_t first, std::size_t end)>& read);

}  // namespace unimapper::datasets
