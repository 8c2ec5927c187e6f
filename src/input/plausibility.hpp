// Plausibility of a recording before it is mapped
#pragma once

#include <optional>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/input/axes.hpp"
#include "src/input/calibration.hpp"
#include "src/input/finding.hpp"
#include "src/input/motion_check.hpp"
#include "src/input/odometry_breaks.hpp"
#include "src/input/pose_rate.hpp"
#include "src/input/ranges.hpp"
#include "src/input/recognition.hpp"
#include "src/input/stamps.hpp"

namespace unimapper::input {

/// What a few dozen scans spread over a recording say.
struct Plausibility {
  RangeFigures ranges;
  DirectionFigures directions;
  DrivenSurface driven;
  Side up = Side::kAbove;  ///< along the odometry's z axis
  SensorFigures sensor;
  MotionFigures motion;
  PoseRate rate;
  OdometryBreaks steps;
  Calibration calibration;  ///< of mount and clock
  MotionMistake mistake;    ///< in the poses, as registered motions show
  std::optional<ClockStep> clock_step;
  AgreementFigures agreement;     ///< of pairs of scans between which the odometry does not break
  std::vector<Finding> findings;  ///< of every check, also where nothing was found
};

/// What was done to the poses already.
struct GivenCorrection {
  /// Mount that they have; empty: one that no option could name.
  std::optional<Pose> T_base_lidar = Pose();
  double time_offset_s = 0.0;  ///< added to their stamps
};

/// Looks at the first `scans` scans of `dataset`: all poses and stamps, the points of at most 32
/// scans, and a few thousand points of every fifth or so. Throws DatasetError as `read_scan` does.
[[nodiscard]] Plausibility examine(const datasets::Dataset& dataset, std::size_t scans,
                                   const GivenCorrection& given = {});

}  // namespace unimapper::input
