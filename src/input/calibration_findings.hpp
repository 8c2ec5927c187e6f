// Findings of calibration, in words
#pragma once

#include <optional>

#include "src/input/calibration.hpp"
#include "src/input/finding.hpp"

namespace unimapper::input {

/// A mount that is off: wrong where it costs static points, suspicious from 0.7 degrees (roll 1.5)
/// or 0.35 m on. `T_base_lidar` is the mount that the given poses have already; empty: one that
/// cannot be named, as of a bag's transforms, which an option would replace.
[[nodiscard]] Finding check_mount(const Calibration& found,
                                  const std::optional<Pose>& T_base_lidar);

/// A mistake that was found: wrong. Says so if a delay would explain the motions, too.
[[nodiscard]] Finding check_motion_mistake(const MotionMistake& mistake);

/// Noise of the given poses from 0.4 degrees on, which hides what other checks find: suspicious.
[[nodiscard]] Finding check_attitude(const Calibration& found);

/// A clock that surely steps: wrong. `time_offset_s` is already added to the stamps of the poses.
[[nodiscard]] Finding check_clock_step(const std::optional<ClockStep>& step, double time_offset_s);

/// Poses that are late or early by more than half a scan: half a scan is what sweeps look like that
/// are not compensated and stamped at an end. `time_offset_s` is already added to
/// their stamps. A `mistake` that explains the motions as well is named, and so is a likely `step`.
[[nodiscard]] Finding check_time(const Calibration& found, double time_offset_s,
                                 const MotionMistake& mistake = {},
                                 const std::optional<ClockStep>& step = {});

}  // namespace unimapper::input
