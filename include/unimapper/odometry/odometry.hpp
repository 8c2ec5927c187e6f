// LiDAR odometry that runs on the robot: scans in, poses out
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/odometry/config.hpp"

namespace unimapper {

/// What is known about the pose.
enum class OdometryState : std::uint8_t {
  kStarting,    ///< too few scans for a velocity: the pose is less certain
  kTracking,    ///< the scan determines all axes
  kDegenerate,  ///< along the weak axes the pose is predicted, not measured
  kLost,        ///< the scan does not fit the local map: the pose is predicted
};

/// Directions that a scan does not determine, in the sensor's frame. A column holds a unit vector
/// of translation above one of rotation, one of which is zero.
struct WeakAxes {
  std::uint32_t count = 0;  ///< columns in use
  /// One in each column, the rest 0.
  Eigen::Matrix<double, 6, 6> axes = Eigen::Matrix<double, 6, 6>::Zero();
};

/// What a scan showed.
struct [[nodiscard]] OdometryResult {
  Error error;  ///< `kOk`, or why the scan was refused: nothing has changed, the rest is as before
  OdometryState state = OdometryState::kStarting;  ///< what is known about the pose
  /// At the scan's stamp. The first accepted scan's is the identity, or levelled by accelerations.
  Pose T_odometry_sensor;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();            ///< in the sensor's frame
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  ///< in the sensor's frame
  /// Of the motion since the scan before: translation along the odometry frame's axes (m²), then
  /// the rotation vector in the sensor's frame (rad²). Wide along weak axes, and where lost. Sums
  /// over scans are those of longer motions.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  WeakAxes weak;     ///< of this scan
  double fit = 0.0;  ///< of this scan to the local map: 1 exactly, 0 not at all, and of the first
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< by the accelerometer, in the odometry frame
  /// Standard deviation of `up` in one direction; infinite where it is not known.
  double up_sigma_rad = std::numeric_limits<double>::infinity();
  const char* reason = "";  ///< why the state is not `kTracking`; static text, never null
};

/// What `Pipeline::add_slip` takes with this scan: covariance of the translation along the weak
/// axes alone, and along all where the odometry is lost; else zero. Along the odometry frame's
/// axes, m².
[[nodiscard]] Eigen::Matrix3d slip_of(const OdometryResult& result) noexcept;

/// Counts since `create`, for diagnosis.
struct OdometryStatistics {
  std::uint64_t scans = 0;                 ///< accepted
  std::uint64_t points_refused = 0;        ///< of scans, in cells that found no room
  std::uint64_t points_without_voxel = 0;  ///< for which one of the two maps had no room, for each
  std::uint32_t voxels = 0;                ///< in the local map
  std::uint32_t restarts = 0;              ///< times the local map was begun anew
  std::uint64_t angular_velocities = 0;    ///< accepted
  std::uint64_t angular_velocities_refused = 0;  ///< not finite, too fast, or not later than before
  std::uint64_t scans_by_gyroscope = 0;          ///< whose rotation the gyroscope foretold
  std::uint64_t scans_against_gyroscope = 0;     ///< for which it was not used: scans contradict it
  std::uint64_t accelerations = 0;               ///< accepted
  std::uint64_t accelerations_refused = 0;  ///< not finite, too large, or not later than before
  std::uint32_t updates_of_up = 0;          ///< by two seconds of accelerations each
  std::uint32_t updates_in_g = 0;           ///< updates of up by samples in g, not in m/s²
  std::uint32_t updates_implausible = 0;    ///< not made: their mean is no gravity in either unit

  /// Whether scans contradict the gyroscope so often (a twentieth of those it was asked for) that
  /// the IMU has other axes, or another clock: its accelerometer is not used then.
  [[nodiscard]] bool imu_contradicted() const noexcept {
    constexpr std::uint64_t kShare = 20;
    return kShare * scans_against_gyroscope > scans_by_gyroscope;
  }
};

/// Registers each scan to a local map of those before. Bounded memory and loops: no heap, no locks,
/// no exceptions, no system call after `create`; the same bits on every machine. Not thread safe.
class LidarOdometry {
 public:
  /// Exactly the bytes that `create` takes; 0 for an invalid configuration.
  static std::size_t required_bytes(const LidarOdometryConfig& config) noexcept;

  /// Lays the odometry out in `memory` (64-byte aligned, at least `required_bytes`), which must
  /// outlive it.
  static Expected<LidarOdometry*> create(const LidarOdometryConfig& config,
                                         std::span<std::byte> memory) noexcept;

  /// Adds a scan in sensor coordinates. `time_s`: when each point was measured, seconds after the
  /// stamp, may be negative; empty where unknown: the scan is then taken as motion-compensated.
  ///
  /// Refuses, with the state unchanged: a stamp that is not later than the last one
  /// (`kTimeReversed`; as that of the mean time of its points), fewer than a hundred thinned points
  /// (`kEmptyScan`), and times of other number than the points (`kInvalidConfig`). Cost: O(points),
  /// and some 15 passes over the thinned ones; where a scan fits badly, a few times that.
  OdometryResult add_scan(std::int64_t stamp_ns, const PointView& points,
                          std::span<const float> time_s) noexcept;

  /// Takes what the gyroscope of an IMU measured, about the sensor's axes, by the clock of the
  /// scans. Optional. Rotations are predicted by it then, and sweeps compensated. It is to be told
  /// of all up to a scan's last point before that scan; where samples are more than 50 ms apart it
  /// is as without. The bias is learned while the sensor hardly turns. Where scans contradict it
  /// (other axes, degrees) it is not used.
  ///
  /// Refuses, counted and with nothing changed: what is not finite, or of 34 rad/s or more
  /// (`kInvalidPose`), and what is not later than the sample before (`kTimeReversed`). The last
  /// 1024 are kept. O(1).
  Error add_angular_velocity(std::int64_t stamp_ns, const Eigen::Vector3d& rad_s) noexcept;

  /// Takes what the accelerometer of an IMU measured along the sensor's axes, by the clock of the
  /// scans, to be told as above: specific forces, at rest 9.81 m/s² along up (those in g are taken
  /// for what they are). Optional. Those of the second before the first scan level its pose. Later
  /// ones, less the accelerations of the registered motion, tell up. By what it has drifted beyond
  /// two sigma the odometry frame is turned back, slowly. Not used while the gyroscope is
  /// contradicted, nor where `imu_contradicted`.
  ///
  /// Refuses, counted and with nothing changed: what is not finite, or of 200 m/s² or more
  /// (`kInvalidPose`), and what is not later than the sample before (`kTimeReversed`). O(1).
  Error add_acceleration(std::int64_t stamp_ns, const Eigen::Vector3d& m_s2) noexcept;

  /// Counts since `create`.
  [[nodiscard]] const OdometryStatistics& statistics() const noexcept;
  /// The configuration it was created with.
  [[nodiscard]] const LidarOdometryConfig& config() const noexcept;

 private:
  struct State;
  LidarOdometry() = default;
  State* state_ = nullptr;
};

}  // namespace unimapper
