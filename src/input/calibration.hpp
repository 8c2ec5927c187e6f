// Hand-eye calibration of mount and clock from given against registered motion
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "src/input/agreement.hpp"
#include "src/input/pose_mistakes.hpp"
#include "src/input/registered_motion.hpp"
#include "src/input/stamps.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Standard deviations from which a delay or a height counts: drift along a straight road looks
/// like a delay and sway on the level like a height, and more surely than they are.
inline constexpr double kMoreSurely = 8.0;
/// Angles from which an error of the mount is said, and corrected where asked for; degrees.
inline constexpr double kSaid_deg = 0.7;
/// Roll from which it is said: it shows in slight tilts of turns alone; degrees.
inline constexpr double kSaidRoll_deg = 1.5;
/// Lever arms from which an error is said; metres.
inline constexpr double kSaid_m = 0.35;

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
  /// By how much roll or pitch of the given poses scatter from scan to scan, against the scans.
  double attitude_noise_deg = 0.0;
  /// Logarithm of how unlikely the motions are with these estimates; without `motions` as well.
  double misfit = 0.0;

  [[nodiscard]] bool shows_rotation() const;   ///< yaw and pitch to half a degree
  [[nodiscard]] bool shows_lever_arm() const;  ///< x and y to 0.3 m
  [[nodiscard]] bool shows_delay() const;      ///< to 0.03 s

  /// Whether twice as many motions would hardly show anything to be said of mount, clock or noise.
  [[nodiscard]] bool is_surely_right() const;

  /// T_given_lidar of what is sure, the identity in all else.
  [[nodiscard]] Pose sure_mount() const;
  /// The delay where it is sure, else 0.
  [[nodiscard]] double sure_delay_s() const;
  /// From which a delay is said, seconds.
  [[nodiscard]] double least_delay_s() const;
};

/// Robust least squares (Gauss-Newton, Cauchy weights) of mount, delay and a scale of the
/// odometry: with M the given motion at stamps plus delay and X the mount, X^-1 M X is the
/// registered one. Noise of the poses, as their fourth differences show it, widens the errors that
/// residuals may have together; it is no evidence for a mount or a delay. Delays of up to ten scans
/// are searched, of a second or five scans at most. Fewer than eight motions tell nothing.
/// O(motions), 20 ms for forty.
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

/// A clock that steps against the other one in the middle of a recording.
struct ClockStep {
  std::size_t scan = 0;   ///< near the step
  double before_s = 0.0;  ///< delay of the poses before it, as `Calibration::delay_s`
  double after_s = 0.0;   ///< delay behind it
  bool is_sure = false;   ///< both parts are sure of the difference
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
