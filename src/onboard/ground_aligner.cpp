#include "ground_aligner.hpp"

#include <algorithm>
#include <cmath>

#include "unimapper/core/cholesky.hpp"
#include "unimapper/core/voxel_key.hpp"

namespace unimapper::onboard {
namespace {

constexpr float kRange_m = 40.0F;
/// Of a scan's tilt so much is corrected: what is left lets the ground follow the odometry's own
/// attitude in the long run.
constexpr double kCorrected = 0.97;
constexpr std::uint32_t kSpan_scans = 30;  ///< of the mean noise
constexpr std::uint32_t kFewestScans = 3;
constexpr std::uint32_t kFewestGroundSamples = 60;
constexpr float kFlat_m = 0.08F;
constexpr std::uint32_t kMostPoints = 40;  ///< of a column's mean: later ones replace earlier ones
/// Scales of the robust fit, coarse to fine: half a degree is 0.35 m at 40 m.
constexpr double kScales_m[] = {0.4, 0.2, 0.1, 0.06, 0.06};

/// Largest integer not above a coordinate, without the maths library; 0 beyond what a double
/// counts.
std::int64_t floor_of(double coordinate_m) noexcept {
  constexpr double kCountable = 9e15;
  if (!(coordinate_m > -kCountable && coordinate_m < kCountable)) return 0;
  const auto truncated = static_cast<std::int64_t>(coordinate_m);
  return truncated - (static_cast<double>(truncated) > coordinate_m ? 1 : 0);
}

/// The rotation of the quaternion (1, x, y, 0), normalised.
Eigen::Matrix3d small_rotation(double x, double y) noexcept {
  const double s = 2.0 / (1.0 + x * x + y * y);
  Eigen::Matrix3d r;
  r << 1.0 - s * y * y, s * x * y, s * y,  //
      s * x * y, 1.0 - s * x * x, -s * x,  //
      -s * y, s * x, 1.0 - s * (x * x + y * y);
  return r;
}

}  // namespace

void GroundAligner::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  on_ = config.ground.align_noise_deg > 0.0F && config.free_space.visibility;
  threshold_rad_ = static_cast<double>(config.ground.align_noise_deg) / kDegreesPerRadian;
  range_min_m_ = config.keyframe.range_min_m;
  if (!on_) return;
  samples_ = arena.allocate<Sample>(kSamples);
  columns_ = arena.allocate<Column>(std::size_t{kEdge} * kEdge);
  capacity_ = (config.removal.window + 2) * config.keyframe.scans;
  corrections_ = arena.allocate<Correction>(capacity_);
}

void GroundAligner::forget() noexcept {
  started_ = false;
  scans_ = 0;
  variance_ = 0.0;
}

float GroundAligner::noise_deg() const noexcept {
  if (scans_ < kFewestScans) return 0.0F;
  return static_cast<float>(std::sqrt(variance_) * kDegreesPerRadian);
}

Pose GroundAligner::align(const PointView& points, const Pose& T_odometry_sensor) noexcept {
  aligned_ = false;
  if (!on_) return T_odometry_sensor;
  if (!started_) {
    base_m_ = T_odometry_sensor.translation.z();
    constexpr Column kEmpty{INT32_MIN, INT32_MIN, 0.0F, 0.0F, 0};
    std::fill_n(columns_, std::size_t{kEdge} * kEdge, kEmpty);
    started_ = true;
  }
  const auto height_m = static_cast<float>(T_odometry_sensor.translation.z() - base_m_);
  collect(points, T_odometry_sensor);
  Tilt tilt;
  Tilt applied;
  if (solve(height_m, tilt)) {
    scans_ = std::min(scans_ + 1, kSpan_scans);
    const double squared = 0.5 * (tilt.about_x * tilt.about_x + tilt.about_y * tilt.about_y);
    variance_ += (squared - variance_) / static_cast<double>(scans_);
    aligned_ = scans_ >= kFewestScans && variance_ >= threshold_rad_ * threshold_rad_;
    // Before the noise is known, only what no ground that was seen before explains.
    aligned_ = aligned_ || (scans_ < kFewestScans && squared >= threshold_rad_ * threshold_rad_);
  }
  if (aligned_) {
    applied = {kCorrected * tilt.about_x, kCorrected * tilt.about_y, kCorrected * tilt.up_m};
  }
  add_to_map(height_m, applied);
  if (!aligned_) return T_odometry_sensor;
  Pose corrected = T_odometry_sensor;
  corrected.rotation =
      small_rotation(0.5 * applied.about_x, 0.5 * applied.about_y) * T_odometry_sensor.rotation;
  corrected.translation.z() += applied.up_m;
  corrections_[next_] = {T_odometry_sensor, corrected};
  next_ = (next_ + 1) % capacity_;
  corrections_size_ = std::min(corrections_size_ + 1, capacity_);
  return corrected;
}

const Pose& GroundAligner::used_pose(const Pose& T_odometry_sensor) const noexcept {
  for (std::uint32_t i = 0; i < corrections_size_; ++i) {
    const Correction& correction = corrections_[i];
    if (correction.given.translation == T_odometry_sensor.translation &&
        correction.given.rotation == T_odometry_sensor.rotation) {
      return correction.used;
    }
  }
  return T_odometry_sensor;
}

void GroundAligner::collect(const PointView& points, const Pose& pose) noexcept {
  size_ = 0;
  const Eigen::Matrix3f r = pose.rotation.cast<float>();
  const std::int64_t floor_x = floor_of(pose.translation.x());
  const std::int64_t floor_y = floor_of(pose.translation.y());
  const auto within_x = static_cast<float>(pose.translation.x() - static_cast<double>(floor_x));
  const auto within_y = static_cast<float>(pose.translation.y() - static_cast<double>(floor_y));
  // Remainders suffice to tell columns of the map apart; far coordinates wrap.
  const auto column_x = static_cast<std::int32_t>(floor_x & 0xFFFFFF);
  const auto column_y = static_cast<std::int32_t>(floor_y & 0xFFFFFF);
  constexpr float kBelow_m = 0.3F;
  // Half of the points are above the sensor or too far.
  const std::size_t stride = std::max<std::size_t>(points.count / (2 * std::size_t{kSamples}), 1);
  // Steps of no pattern: rings and columns have one.
  std::uint32_t random = 1;
  const auto next = [&random, stride](std::size_t i) noexcept {
    random = random * 1664525U + 1013904223U;
    return i + 1 + (random >> 8U) % (2 * stride - 1);
  };
  for (std::size_t i = 0; i < points.count && size_ < kSamples; i = next(i)) {
    const Eigen::Vector3f p = points[i];
    const float squared = p.squaredNorm();
    // False for NaN.
    if (!(squared >= range_min_m_ * range_min_m_ && squared <= kRange_m * kRange_m)) continue;
    const Eigen::Vector3f q = r * p;
    if (q.z() > -kBelow_m) continue;
    const std::int32_t x = column_x + floor_to_int(within_x + q.x());
    const std::int32_t y = column_y + floor_to_int(within_y + q.y());
    Column& column = columns_[(y & (kEdge - 1)) * kEdge + (x & (kEdge - 1))];
    if (column.x != x || column.y != y) column = {x, y, 0.0F, 0.0F, 0};
    constexpr std::uint32_t kFewestPoints = 1;
    const bool known = column.points >= kFewestPoints && column.scatter_m < kFlat_m;
    samples_[size_++] = {q.x(), q.y(), q.z(), &column, known};
  }
}

bool GroundAligner::solve(float sensor_height_m, Tilt& tilt) const noexcept {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  for (const double scale_m : kScales_m) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    std::uint32_t used = 0;
    for (std::uint32_t i = 0; i < size_; ++i) {
      const Sample& sample = samples_[i];
      if (!sample.known) continue;
      // How the point rises with each parameter, and by how much it should.
      const double ax = static_cast<double>(sample.y_m);
      const double ay = -static_cast<double>(sample.x_m);
      const double missing_m =
          static_cast<double>(sample.column->height_m - (sensor_height_m + sample.z_m));
      const double rest = (missing_m - (ax * x(0) + ay * x(1) + x(2))) / scale_m;
      const double weight = 1.0 / ((1.0 + rest * rest) * (1.0 + rest * rest));
      normal(0, 0) += weight * ax * ax;
      normal(1, 0) += weight * ay * ax;
      normal(1, 1) += weight * ay * ay;
      normal(2, 0) += weight * ax;
      normal(2, 1) += weight * ay;
      normal(2, 2) += weight;
      right += weight * missing_m * Eigen::Vector3d(ax, ay, 1.0);
      ++used;
    }
    if (used < kFewestGroundSamples) return false;
    // Ground on all sides: a tilt is not to be had from a strip.
    constexpr double kExtent_m2 = 2.0;
    if (normal(0, 0) < kExtent_m2 * normal(2, 2) || normal(1, 1) < kExtent_m2 * normal(2, 2)) {
      return false;
    }
    const Cholesky<3> factor(normal);
    if (!factor.valid()) return false;
    x = factor.solve(right);
  }
  constexpr double kMost_rad = 0.1;
  constexpr double kMost_m = 0.5;
  if (!(std::abs(x(0)) < kMost_rad && std::abs(x(1)) < kMost_rad && std::abs(x(2)) < kMost_m)) {
    return false;
  }
  tilt = {x(0), x(1), x(2)};
  return true;
}

void GroundAligner::add_to_map(float sensor_height_m, const Tilt& applied) noexcept {
  const auto about_x = static_cast<float>(applied.about_x);
  const auto about_y = static_cast<float>(applied.about_y);
  const float shift_m = sensor_height_m + static_cast<float>(applied.up_m);
  for (std::uint32_t i = 0; i < size_; ++i) {
    const Sample& sample = samples_[i];
    Column& column = *sample.column;
    const float height_m = shift_m + sample.z_m + about_x * sample.y_m - about_y * sample.x_m;
    if (column.points == 0) {
      column.height_m = height_m;
      column.points = 1;
      continue;
    }
    const float off_m = height_m - column.height_m;
    column.points = std::min(column.points + 1, kMostPoints);
    const float share = 1.0F / static_cast<float>(column.points);
    column.height_m += share * off_m;
    column.scatter_m += share * (std::fabs(off_m) - column.scatter_m);
  }
}

}  // namespace unimapper::onboard
