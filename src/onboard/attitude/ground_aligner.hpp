// Alignment of scans in roll, pitch and height to the ground seen before
#pragma once

#include <cstdint>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Measures how far the ground of a scan, at the pose it came with, is tilted against the ground of
/// the scans before: a height map around the sensor, and robust least squares (Geman-McClure) for
/// roll, pitch and height. Its own error is measured, too: two halves of the ground, blocks of 8 m
/// like the fields of a chessboard, are fitted each for itself. What the mean square over the last
/// scans has beyond that error is the noise of the attitude, and not known if that is not clearly
/// more than the error. Where it is more than free space can stand, poses are corrected.
///
/// Scans whose points are not motion-compensated tilt, too: with the sensor's own rotation, by
/// about half of what it turns from one scan to the next. Attitude noise does not follow it.
class GroundAligner {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;
  void forget() noexcept;

  /// The pose of a scan, corrected if the noise asks for it. O(1): a bounded share of the points.
  [[nodiscard]] Pose align(const PointView& points, const Pose& T_odometry_sensor) noexcept;

  /// Root mean square of roll and pitch against the ground before, degrees; 0 = not known, or
  /// `sweep_tilt_deg` is what it is.
  [[nodiscard]] float noise_deg() const noexcept;
  /// Root mean square of roll and pitch, degrees, where scans tilt with the sensor's rotation; else
  /// 0. Such scans look uncompensated.
  [[nodiscard]] float sweep_tilt_deg() const noexcept;
  /// The pose that a scan of the window was used at, by the pose that came with it.
  [[nodiscard]] const Pose& used_pose(const Pose& T_odometry_sensor) const noexcept;
  /// The last scan was corrected.
  [[nodiscard]] bool aligned() const noexcept { return aligned_; }

 private:
  static constexpr std::uint32_t kSamples = 3072;
  static constexpr std::int32_t kEdge = 128;  ///< columns along an edge of the map

  /// The height of what lies in a column of 1 m, in a map that wraps around.
  struct Column {
    std::int32_t x;  ///< index, of which the map keeps the remainder
    std::int32_t y;
    float height_m;   ///< mean, above `base_m_`
    float scatter_m;  ///< mean distance of points from it
    std::uint32_t points;
  };
  /// A point below the sensor, relative to it along the odometry's axes.
  struct Sample {
    float x_m;
    float y_m;
    float z_m;
    Column* column;
    std::uint8_t half;  ///< 1 or 2 where the column's height is known and it is flat, else 0
  };
  /// Small rotations about the odometry's x and y axes, radians, and a shift along z, metres.
  struct Tilt {
    double about_x = 0.0;
    double about_y = 0.0;
    double up_m = 0.0;
    /// Mean square about the two axes, rad².
    [[nodiscard]] double squared() const noexcept {
      return 0.5 * (about_x * about_x + about_y * about_y);
    }
  };

  struct Correction {
    Pose given;
    Pose used;
  };

  /// How the tilt of scans varies with the turn of the sensor about them, over the last scans.
  struct Follow {
    /// A vector of one layout whether Eigen vectorises or not.
    using Mean = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
    std::uint32_t scans = 0;
    Mean mean_tilt = Mean::Zero();
    Mean mean_turn = Mean::Zero();  ///< from the scan before to that after
    double tilt_variance = 0.0;     ///< of both axes together
    double turn_variance = 0.0;     ///< of both axes together
    double covariance = 0.0;        ///< of tilt and turn
    void add(const Eigen::Vector2d& tilt, const Eigen::Vector2d& turn) noexcept;
    /// Points of a whole sweep lie at one pose.
    [[nodiscard]] bool is_clear() const noexcept;
  };

  /// Ground that is far from level in the odometry's frame, as where that starts at identity with a
  /// tilted sensor: its slope along x and y; zero if it is about level, or not found.
  [[nodiscard]] Eigen::Vector2f find_slope(const PointView& points, const Pose& pose) noexcept;
  /// Height of a point above what the slope explains.
  [[nodiscard]] float above_slope(float x_m, float y_m, float z_m) const noexcept {
    return z_m - slope_.x() * x_m - slope_.y() * y_m;
  }
  void collect(const PointView& points, const Pose& pose) noexcept;
  /// Least squares over the samples of both halves (bits 1 and 2 of `halves`) or of one.
  [[nodiscard]] bool solve(float sensor_height_m, std::uint8_t halves, Tilt& tilt) const noexcept;
  /// Half the difference of the tilts of the two halves; false if one has too little ground.
  [[nodiscard]] bool measure_error(float sensor_height_m, Tilt& error) const noexcept;
  /// Adds a scan's tilt to the statistics if its error is known; true if it alone, before the
  /// statistics tell anything, is noise.
  [[nodiscard]] bool add_to_noise(float sensor_height_m, const Tilt& tilt) noexcept;
  void follow(bool measured, const Tilt& tilt, const Pose& pose) noexcept;
  /// The scatter is clearly more than its own error.
  [[nodiscard]] bool is_noise_known() const noexcept;
  void add_to_map(float sensor_height_m, const Tilt& applied) noexcept;

  float range_min_m_ = 0.0F;
  double threshold_rad_ = 0.0;
  bool on_ = false;
  bool started_ = false;
  bool aligned_ = false;
  Eigen::Vector3d base_m_ = Eigen::Vector3d::Zero();  ///< from which heights count
  Eigen::Vector2f slope_ = Eigen::Vector2f::Zero();   ///< of the ground, along x and y
  double variance_ = 0.0;                             ///< of roll and pitch, rad²
  double error_variance_ = 0.0;                       ///< of their measurement, rad²
  std::uint32_t scans_ = 0;                           ///< measured, up to the span of the mean
  std::uint32_t in_a_row_ = 0;    ///< scans whose tilt is known, up to the last one
  Tilt tilt_before_;              ///< of the last scan
  Eigen::Matrix3d rotations_[2];  ///< of the last scan and the one before, their tilt taken out
  Follow follow_;
  std::uint32_t size_ = 0;
  Sample* samples_ = nullptr;
  Column* columns_ = nullptr;
  // The last corrections: a ring that holds those of all scans in the window.
  std::uint32_t capacity_ = 0;
  std::uint32_t corrections_size_ = 0;
  std::uint32_t next_ = 0;
  Correction* corrections_ = nullptr;
};

}  // namespace unimapper::onboard
