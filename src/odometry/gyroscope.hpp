// Rotation by the gyroscope of an IMU.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "imu_samples.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/expected.hpp"

namespace unimapper::odometry {

/// The latest angular velocities, their bias, and whether they are worth more than the assumption
/// that the velocity stays as it was.
class Gyroscope {
 public:
  void allocate(Arena& arena) noexcept { samples_.allocate(arena); }

  /// Takes a sample. Refuses, with nothing changed, what is not finite, faster than a gyroscope can
  /// tell, or not later than the one before.
  Error add(std::int64_t stamp_ns, const Eigen::Vector3d& rad_s) noexcept;

  /// R_from_to between two times, `to_ns` the later one; false where samples leave a gap. O(samples
  /// between them).
  bool rotation(std::int64_t from_ns, std::int64_t to_ns, Eigen::Matrix3d& turn) const noexcept;

  /// Whether scans have shown that velocities foretell rotations better.
  [[nodiscard]] bool is_contradicted() const noexcept;

  /// Compares a rotation that was registered with what samples and velocity had foretold.
  void learn(const Eigen::Matrix3d& registered, const Eigen::Matrix3d& by_samples,
             const Eigen::Matrix3d& by_velocity, double seconds) noexcept;

 private:
  ImuSamples samples_;  // rad/s
  Eigen::Vector3d bias_rad_s_ = Eigen::Vector3d::Zero();
  std::uint32_t slow_scans_ = 0;  // that showed the bias
  double error_ = 0.0;            // usual squared one of the samples, rad²
  double error_of_velocity_ = 0.0;
};

/// Rotations within a sweep.
struct SweepTurns {
  static constexpr int kCount = 33;  // of a sweep that turns by 90 degrees, 3 each
  float first_s = 0.0F;              ///< after the middle of the scan
  float last_s = 0.0F;
  Eigen::Matrix3d R_middle_then[kCount];
};

}  // namespace unimapper::odometry
