// Hand-eye calibration of mount and clock from given against registered motion
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "src/core/calibration.hpp"
#include "src/input/agreement.hpp"
#include "src/input/pose_mistakes.hpp"
#include "src/input/registered_motion.hpp"
#include "src/input/stamps.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Mount, delay and scale by `HandEye`. Noise of the poses is what their fourth differences show.
/// Delays of up to ten scans are searched, of a second or five scans at most. O(motions), 20 ms for
/// forty.
[[nodiscard]] Calibration calibrate(const Track& track, std::span<const RegisteredMotion> motions);

/// Mistakes that make the given motions those that the scans show, the best first.
struct MotionMistake {
  std::vector<std::string> names;
  std::vector<std::string> remedies;  ///< of the best, and of up to two that explain as well
  bool is_better_than_delay = false;  ///< no mount and delay explain the motions nearly as well
};

/// Tries the mistakes that correct each pose by itself and have a name of their own. One that is
/// found explains motions better than the poses as they are by `surely`, and as well as `found`
/// does. That is a difference of logarithms: right drives, most of them with noise, had up to 2.4.
/// O(motions) for each mistake, 2 ms for forty.
[[nodiscard]] MotionMistake find_motion_mistake(const Track& track,
                                                std::span<const RegisteredMotion> motions,
                                                const std::vector<PoseMistake>& mistakes,
                                                const Calibration& found, double surely = 6.0);

/// A clock that steps against the other one in the middle of a recording, or drifts.
struct ClockStep {
  std::size_t scan = 0;   ///< near the step
  double before_s = 0.0;  ///< delay of the poses before it, as `Calibration::delay_s`
  double after_s = 0.0;   ///< delay behind it
  bool is_sure = false;   ///< both parts are sure of the difference
  bool is_drift = false;  ///< a delay that grows evenly fits as well: the first and the last
};

/// Where the motions of one part likely show one delay, and those of the rest another one, which
/// differ by 0.07 s and more; both fit better than one delay by `likely`, a difference of
/// logarithms. Delays of up to two seconds are tried. O(motions), 10 ms for forty.
[[nodiscard]] std::optional<ClockStep> find_clock_step(const Track& track,
                                                       std::span<const RegisteredMotion> motions,
                                                       double likely = 5.0);

/// How much more the scans of pairs agree under poses that are taken `delay_s` later than under the
/// given ones: the mean over pairs that tell and have such poses; 0 without any. About 1 ms a pair.
[[nodiscard]] double gained_agreement(const Track& track, std::span<const ScanPair> pairs,
                                      double delay_s);

/// A delay with which the scans do not agree better than without it is none: it becomes as
/// uncertain as it is long.
void leave_out_unseen_delay(Estimate& delay_s, double gained);

}  // namespace unimapper::input
