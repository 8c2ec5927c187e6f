// Hand-eye calibration of mount and clock from given against registered motion
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/input/agreement.hpp"
#include "src/input/finding.hpp"
#include "src/input/pose_mistakes.hpp"
#include "src/input/stamps.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Motion between two scans, as their registration found it.
struct RegisteredMotion {
  std::int64_t first_ns = 0;   ///< stamps of the scans
  std::int64_t second_ns = 0;  ///< later
  Pose T_first_second;
};

/// A value with its standard deviation.
struct Estimate {
  double value = 0.0;
  double sigma = 0.0;  ///< large where the motion does not show it

  /// Whether it differs from 0 by more than `least`, and by `surely` standard deviations.
  [[nodiscard]] bool is_surely_beyond(double least, double surely = 4.0) const;
};

/// What registered motions say of the frame whose poses are given, and of its clock.
struct Calibration {
  std::size_t motions = 0;  ///< that were compared; 0: too few, nothing is known
  /// The LiDAR on the frame whose poses are given: the fixed axes x, y, z in this order.
  Estimate roll_deg, pitch_deg, yaw_deg;
  Estimate x_m, y_m, z_m;
  /// Positive where poses are late: the pose of time t is stamped t + delay.
  Estimate delay_s;

  double interval_s = 0.0;  ///< median, from stamp to stamp
  /// Logarithm of how unlikely the motions are with these estimates; without `motions` as well.
  double misfit = 0.0;

  [[nodiscard]] bool shows_rotation() const;   ///< yaw and pitch to half a degree
  [[nodiscard]] bool shows_lever_arm() const;  ///< x and y to 0.3 m
  [[nodiscard]] bool shows_delay() const;      ///< to 0.03 s

  /// T_given_lidar of what is sure, the identity in all else.
  [[nodiscard]] Pose sure_mount() const;
  /// The delay where it is sure, else 0.
  [[nodiscard]] double sure_delay_s() const;
};

/// Robust least squares (Gauss-Newton, Cauchy weights) of mount, delay and a scale of the
/// odometry: with M the given motion at stamps plus delay and X the mount, X^-1 M X is the
/// registered one. Delays of up to ten scans are searched, of a second or five scans at most. Fewer
/// than eight motions tell nothing. O(motions), 20 ms for forty.
[[nodiscard]] Calibration calibrate(const Track& track, std::span<const RegisteredMotion> motions);

/// Mistakes that make the given motions those that the scans show, the best first.
struct MotionMistake {
  std::vector<std::string> names;
  std::vector<std::string> remedies;  ///< of the best, and of up to two that explain as well
  bool is_better_than_delay = false;  ///< no mount and delay explain the motions nearly as well
};

/// Tries the mistakes that correct each pose by itself and have a name of their own. One that is
/// found explains motions far better than the poses as they are, and as well as `found` does.
/// O(motions) for each mistake, 2 ms for forty.
[[nodiscard]] MotionMistake find_motion_mistake(const Track& track,
                                                std::span<const RegisteredMotion> motions,
                                                const std::vector<PoseMistake>& mistakes,
                                                const Calibration& found);

/// A clock that steps against the other one in the middle of a recording.
struct ClockStep {
  std::size_t scan = 0;   ///< near the step
  double before_s = 0.0;  ///< delay of the poses before it, as `Calibration::delay_s`
  double after_s = 0.0;   ///< delay behind it
  bool is_sure = false;   ///< both parts are sure of the difference
};

/// Where the motions of one part likely show one delay, and those of the rest another one, which
/// differ by 0.07 s and more. Delays of up to two seconds are tried. O(motions), 10 ms for forty.
[[nodiscard]] std::optional<ClockStep> find_clock_step(const Track& track,
                                                       std::span<const RegisteredMotion> motions);

/// Registers up to forty pairs of scans where the sensor moves far, turns or changes its speed, and
/// keeps what can be trusted: scans that agree well, and no tunnels. `skips(i, j)`: no pose between
/// these is right. `read` fills a scan. About 30 ms a pair.
[[nodiscard]] std::vector<RegisteredMotion> register_motions(
    const Track& track, const std::function<bool(std::size_t, std::size_t)>& skips,
    const std::function<void(std::size_t, datasets::Scan&)>& read);

/// How much more the scans of pairs agree under poses that are taken `delay_s` later than under the
/// given ones: the mean over pairs that tell and have such poses; 0 without any. About 1 ms a pair.
[[nodiscard]] double gained_agreement(const Track& track, std::span<const ScanPair> pairs,
                                      double delay_s);

/// A delay with which the scans do not agree better than without it is none: it becomes as
/// uncertain as it is long.
void leave_out_unseen_delay(Estimate& delay_s, double gained);

/// A mount that is off: wrong where it costs static points, suspicious from 0.7 degrees (roll 1.5)
/// or 0.35 m on. `T_base_lidar` is the mount that the given poses have already; empty: one that
/// cannot be named, as of a bag's transforms, which an option would replace.
[[nodiscard]] Finding check_mount(const Calibration& found,
                                  const std::optional<Pose>& T_base_lidar);

/// A mistake that was found: wrong. Says so if a delay would explain the motions, too.
[[nodiscard]] Finding check_motion_mistake(const MotionMistake& mistake);

/// A clock that surely steps: wrong. `time_offset_s` is already added to the stamps of the poses.
[[nodiscard]] Finding check_clock_step(const std::optional<ClockStep>& step, double time_offset_s);

/// Poses that are late or early by more than half a scan: half a scan is what sweeps look like that
/// are not compensated and stamped at an end. `time_offset_s` is already added to
/// their stamps. A `mistake` that explains the motions as well is named, and so is a likely `step`.
[[nodiscard]] Finding check_time(const Calibration& found, double time_offset_s,
                                 const MotionMistake& mistake = {},
                                 const std::optional<ClockStep>& step = {});

}  // namespace unimapper::input
