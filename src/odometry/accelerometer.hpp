// Up by the accelerometer of an IMU.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "imu_samples.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/expected.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::odometry {

/// The rotation by the least angle that turns a unit vector to the z axis. Products alone.
[[nodiscard]] Eigen::Matrix3d levelling(const Eigen::Vector3d& up) noexcept;

/// Estimates what stays of specific forces without the accelerations of the registered motion: g
/// along up. Their bias is part of the estimate, and of its uncertainty. Frame of all vectors: that
/// of the registered poses, the map's.
class Accelerometer {
 public:
  void allocate(Arena& arena) noexcept { samples_.allocate(arena); }

  /// Takes a sample. Refuses, with nothing changed, what is not finite, beyond 200 m/s², or not
  /// later than the one before.
  Error add(std::int64_t stamp_ns, const Eigen::Vector3d& m_s2) noexcept;

  /// Begins with the first scan: R_map_sensor, level by the second before it; the identity where
  /// samples do not tell.
  [[nodiscard]] Eigen::Matrix3d begin(std::int64_t now_ns) noexcept;

  /// Where the sensor has moved.
  struct Motion {
    Pose T_map_before;
    std::int64_t before_ns = 0;
    Pose T_map_now;
    std::int64_t now_ns = 0;
    Eigen::Matrix3d weak = Eigen::Matrix3d::Zero();  ///< projector onto weak axes of translation
    bool is_rotation_weak = false;
  };
  /// Takes a motion that was registered. O(samples meanwhile).
  void move(const Motion& motion) noexcept;

  /// A scan was lost: its pose says nothing about accelerations, and little about rotations. Nor
  /// does the way from there to the next one that is registered.
  void lose(double seconds) noexcept;

  /// Whether up is known.
  [[nodiscard]] bool is_known() const noexcept { return updates_ > 0; }
  /// Unit vector.
  [[nodiscard]] Eigen::Vector3d up() const noexcept { return state_.head<3>().normalized(); }
  /// Standard deviation of up in one direction, widened while forces do not fit.
  [[nodiscard]] double sigma_rad() const noexcept;
  /// Standard deviation of up if forces fit as well as they should.
  [[nodiscard]] double sigma_of_fit_rad() const noexcept;

  /// Counts of two seconds each.
  [[nodiscard]] std::uint32_t updates() const noexcept { return updates_; }
  [[nodiscard]] std::uint32_t updates_in_g() const noexcept { return updates_in_g_; }
  [[nodiscard]] std::uint32_t implausible() const noexcept { return implausible_; }

 private:
  /// Weighted sums of forces, and of the rotations that turned them to the map.
  struct Sums {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
    double weight = 0.0;
    void add(const Eigen::Vector3d& f, const Eigen::Matrix3d& R, double w) noexcept;
    [[nodiscard]] Sums less(const Sums& other, double share) const noexcept;
  };
  /// A place where a window of about a second begins or ends.
  struct Knot {
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
    std::int64_t stamp_ns = 0;
  };
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;

  void open_window(const Pose& pose, std::int64_t stamp_ns) noexcept;
  void close_window(const Motion& motion) noexcept;
  void update(const Sums& sums, const Eigen::Vector3d& acceleration_m_s2) noexcept;
  void widen(double variance_rad2) noexcept;
  [[nodiscard]] bool has_unit(double mean_force) noexcept;

  ImuSamples samples_;      // in m/s² or g
  std::uint64_t next_ = 0;  // to be taken

  bool was_lost_ = false;  // the pose that the next motion begins at is foretold
  bool is_open_ = false;
  bool has_left_ = false;  // the window at hand is the second one of two
  Knot knots_[2];
  Sums left_;     // of the first window, by weights that rise to one
  Sums sums_;     // of the window at hand
  Sums moments_;  // the same, times the time since it began
  Eigen::Matrix3d weak_ = Eigen::Matrix3d::Zero();

  Vector6d state_ = Vector6d::Zero();  // g along up; bias in the sensor's frame, m/s²
  Matrix6d covariance_ = Matrix6d::Zero();
  double unit_ = 0.0;       // of samples, in m/s²; 0: not known yet
  std::uint32_t in_g_ = 0;  // windows in a row that told g before it was known
  double misfit_ = 1.0;     // of forces: mean square of what is off, by its variance
  std::uint32_t updates_ = 0;
  std::uint32_t updates_in_g_ = 0;
  std::uint32_t implausible_ = 0;
};

}  // namespace unimapper::odometry
