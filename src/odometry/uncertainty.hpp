// Uncertainty of the motion from scan to scan.
#pragma once

#include "registration.hpp"
#include "unimapper/odometry/odometry.hpp"

namespace unimapper::odometry {

/// Covariance of each scan's motion, and what is known of the motion along weak axes.
class WeakMotion {
 public:
  /// Takes a scan that was registered, `seconds` after the one before, and whose stamp is `ahead_s`
  /// after the middle of its points. `R_sensor_odometry` turns the odometry frame's axes into the
  /// sensor's. The covariance is as in `OdometryResult`.
  Matrix6d add(const Registered& found, double seconds, double ahead_s,
               const Eigen::Matrix3d& R_sensor_odometry) noexcept;

  /// The covariance of a motion of which nothing is known but the time it took.
  Matrix6d lose(double seconds) noexcept;

  /// Whether a robot can be at `found` where it was `predicted`, `seconds` after the scan before:
  /// by an acceleration, and by what was not known of its motion.
  [[nodiscard]] bool is_possible(const Pose& predicted, const Pose& found,
                                 double seconds) const noexcept;

  /// Weak axes of the scan that was added last, in the sensor's frame.
  [[nodiscard]] WeakAxes axes(const Eigen::Matrix3d& R_sensor_odometry) const noexcept;

  /// Whether so small a share of the points says much about an axis that it is weak.
  [[nodiscard]] static bool is_weak(double share) noexcept { return !(share > kWeak); }

  /// Whether a scan that determined all axes has shown a velocity since the start.
  [[nodiscard]] bool is_velocity_known() const noexcept { return is_velocity_known_; }

 private:
  static constexpr double kWeak = 0.002;
  /// Scans in a row that determine an axis before its velocity is sure: another vehicle, or a few
  /// fittings, do so for one or two.
  static constexpr std::uint32_t kTellVelocity = 3;
  /// Scans in a row that determine all axes before a first velocity is sure: nothing foretells it,
  /// and a vehicle may be beside the robot for half a second.
  static constexpr std::uint32_t kTellFirstVelocity = 10;

  /// The time since scans last told the velocity along all axes of a kind.
  struct OpenMotion {
    double seconds = 0.0;
    std::uint32_t determined_scans = 0;  ///< in a row

    double go_on(double more_s) noexcept {
      determined_scans = 0;
      return seconds += more_s;
    }
    void end_by_scan() noexcept {
      if (++determined_scans >= kTellVelocity) seconds = 0.0;
    }
  };

  [[nodiscard]] double variance_after(double seconds, bool is_rotation) const noexcept;
  /// What a sum over all motions of `open_s` is to be, less what it was `seconds` before.
  [[nodiscard]] double variance_of(double open_s, double seconds, bool is_rotation) const noexcept;

  Determination determination_;
  bool is_weak_[6] = {};
  OpenMotion open_[2];            // of translation, of rotation
  std::uint32_t sure_scans_ = 0;  // in a row
  bool is_velocity_known_ = false;
  bool is_velocity_sure_ = false;  // told by enough scans
  bool is_lost_ = false;           // until scans tell the velocity again
};

/// Which axes are weak, in words; empty if none is.
[[nodiscard]] const char* reason_of(const WeakAxes& weak) noexcept;

}  // namespace unimapper::odometry
