#include "ground_aligner.hpp"

#include <algorithm>
#include <cmath>

#include "src/core/cholesky.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper::onboard {
namespace {

constexpr float kRange_m = 40.0F;
/// Of a scan's tilt so much is corrected: what is left lets the ground follow the odometry's own
/// attitude in the long run.
constexpr double kCorrected = 0.97;
constexpr std::uint32_t kSpan_scans = 30;  ///< of the mean noise
constexpr std::uint32_t kFewestScans = 3;
constexpr std::uint32_t kFewestGroundSamples = 30;  ///< of a half
constexpr std::int32_t kHalfBlock_log2_m = 3;
constexpr std::uint8_t kBothHalves = 3;
constexpr float kFlat_m = 0.08F;
constexpr std::uint32_t kMostPoints = 40;  ///< of a column's mean: later ones replace earlier ones
/// Scales of the robust fit, coarse to fine: half a degree is 0.35 m at 40 m.
constexpr double kScales_m[] = {0.4, 0.2, 0.1, 0.06, 0.06};

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
  error_variance_ = 0.0;
  in_a_row_ = 0;
  follow_ = {};
}

bool GroundAligner::is_noise_known() const noexcept {
  // Quantiles of the F distribution with as many degrees of freedom, roughly: one draw in a
  // thousand is beyond, and up to half of the variance may be an error that both halves share.
  const double least_ratio = 4.0 + 48.0 / static_cast<double>(std::max(scans_, 1U));
  return scans_ >= kFewestScans && variance_ >= least_ratio * error_variance_;
}

float GroundAligner::noise_deg() const noexcept {
  if (!is_noise_known() || follow_.is_clear()) return 0.0F;
  return static_cast<float>(std::sqrt(variance_ - error_variance_) * kDegreesPerRadian);
}

float GroundAligner::sweep_tilt_deg() const noexcept {
  if (!follow_.is_clear()) return 0.0F;
  return static_cast<float>(std::sqrt(0.5 * follow_.tilt_variance) * kDegreesPerRadian);
}

void GroundAligner::Follow::add(const Eigen::Vector2d& tilt, const Eigen::Vector2d& turn) noexcept {
  scans = std::min(scans + 1, kSpan_scans);
  const double share = 1.0 / static_cast<double>(scans);
  const Eigen::Vector2d tilt_off = tilt - mean_tilt;
  const Eigen::Vector2d turn_off = turn - mean_turn;
  mean_tilt += share * tilt_off;
  mean_turn += share * turn_off;
  const double keep = 1.0 - share;
  tilt_variance = keep * (tilt_variance + share * tilt_off.squaredNorm());
  turn_variance = keep * (turn_variance + share * turn_off.squaredNorm());
  covariance = keep * (covariance + share * tilt_off.dot(turn_off));
}

bool GroundAligner::Follow::is_clear() const noexcept {
  constexpr std::uint32_t kFewest = 15;
  // Points of a whole sweep at the pose of its first or last one tilt by a quarter of what the
  // sensor turns in two sweeps.
  constexpr double kLeastShareOfTurn = 0.15;
  constexpr double kLeastExplained = 0.4;
  // 0.05 degrees, 2 cm at 25 m: less is chance, and harms nothing.
  constexpr double kLeastTilt_rad = 0.05 / kDegreesPerRadian;
  const double squared = covariance * covariance;
  return scans >= kFewest && turn_variance > 0.0 &&
         0.5 * tilt_variance >= kLeastTilt_rad * kLeastTilt_rad &&
         squared >= kLeastExplained * tilt_variance * turn_variance &&
         squared >= kLeastShareOfTurn * kLeastShareOfTurn * turn_variance * turn_variance;
}

Pose GroundAligner::align(const PointView& points, const Pose& T_odometry_sensor) noexcept {
  aligned_ = false;
  if (!on_) return T_odometry_sensor;
  if (!started_) {
    base_m_ = T_odometry_sensor.translation;
    slope_ = find_slope(points, T_odometry_sensor);
    constexpr Column kEmpty{INT32_MIN, INT32_MIN, 0.0F, 0.0F, 0};
    std::fill_n(columns_, std::size_t{kEdge} * kEdge, kEmpty);
    started_ = true;
  }
  const Eigen::Vector3f moved_m = (T_odometry_sensor.translation - base_m_).cast<float>();
  const float height_m = above_slope(moved_m.x(), moved_m.y(), moved_m.z());
  collect(points, T_odometry_sensor);
  Tilt tilt;
  Tilt applied;
  const bool measured = solve(height_m, kBothHalves, tilt);
  // Before the noise is known, only what no ground that was seen before explains.
  const bool stands_out = measured && add_to_noise(height_m, tilt);
  follow(measured, tilt, T_odometry_sensor);
  const double threshold = threshold_rad_ * threshold_rad_;
  const bool is_noisy = is_noise_known() && variance_ >= threshold;
  const bool is_uncompensated = follow_.is_clear() && 0.5 * follow_.tilt_variance >= threshold;
  aligned_ = measured && (is_noisy || is_uncompensated || stands_out);
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

bool GroundAligner::add_to_noise(float sensor_height_m, const Tilt& tilt) noexcept {
  Tilt error;
  if (!measure_error(sensor_height_m, error)) return false;
  scans_ = std::min(scans_ + 1, kSpan_scans);
  const double share = 1.0 / static_cast<double>(scans_);
  variance_ += share * (tilt.squared() - variance_);
  error_variance_ += share * (error.squared() - error_variance_);
  // Clearer than over many scans, for the error of one scan is one draw.
  constexpr double kMore = 2.0;
  constexpr double kClearOfError = 8.0;
  return scans_ < kFewestScans &&
         tilt.squared() >= kMore * kMore * threshold_rad_ * threshold_rad_ &&
         tilt.squared() >= kClearOfError * kClearOfError * error.squared();
}

void GroundAligner::follow(bool measured, const Tilt& tilt, const Pose& pose) noexcept {
  if (!measured) {
    in_a_row_ = 0;
    return;
  }
  const Eigen::Matrix3d rotation =
      small_rotation(0.5 * tilt.about_x, 0.5 * tilt.about_y) * pose.rotation;
  if (in_a_row_ >= 2) {
    // The tilt of the scan between, against the turn about it: neither has the other's noise.
    const Eigen::Matrix3d turn = rotation * rotations_[1].transpose();
    follow_.add({tilt_before_.about_x, tilt_before_.about_y},
                {0.5 * (turn(2, 1) - turn(1, 2)), 0.5 * (turn(0, 2) - turn(2, 0))});
  }
  rotations_[1] = rotations_[0];
  rotations_[0] = rotation;
  tilt_before_ = tilt;
  in_a_row_ = std::min(in_a_row_ + 1, 2U);
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

Eigen::Vector2f GroundAligner::find_slope(const PointView& points, const Pose& pose) noexcept {
  constexpr float kRangeOfSlope_m = 20.0F;
  constexpr std::uint32_t kMost = 1024;
  const Eigen::Matrix3f r = pose.rotation.cast<float>();
  const std::size_t stride = std::max<std::size_t>(points.count / (2 * std::size_t{kMost}), 1);
  std::uint32_t size = 0;
  for (std::size_t i = 0; i < points.count && size < kMost; i += stride) {
    const Eigen::Vector3f p = points[i];
    const float squared = p.squaredNorm();
    // False for NaN.
    if (!(squared >= range_min_m_ * range_min_m_ && squared <= kRangeOfSlope_m * kRangeOfSlope_m)) {
      continue;
    }
    const Eigen::Vector3f q = r * p;
    samples_[size++] = {q.x(), q.y(), q.z(), nullptr, 0};
  }
  // How much what lies below the sensor concentrates in one plane of this slope.
  const auto score = [this, size](float x, float y) noexcept {
    constexpr float kLayers_per_m = 4.0F;
    constexpr std::uint32_t kLayers = 64;
    std::uint16_t layers[kLayers] = {};
    std::uint32_t squares = 0;
    for (std::uint32_t i = 0; i < size; ++i) {
      const Sample& q = samples_[i];
      const float below = -(q.z_m - x * q.x_m - y * q.y_m) * kLayers_per_m;
      if (!(below >= 2.0F && below < static_cast<float>(kLayers))) continue;
      squares += 2U * layers[static_cast<std::uint32_t>(below)]++ + 1U;
    }
    return squares;
  };
  // Slopes in steps of 1.4 degrees. Level wins unless another is clearly better: a wall and a
  // pavement share planes, too, mostly steep ones.
  constexpr std::int32_t kSteps = 14;
  constexpr float kStep = 0.025F;
  constexpr std::uint32_t kClearlyBetter = 4;
  Eigen::Vector2f best = Eigen::Vector2f::Zero();
  std::uint32_t most = kClearlyBetter * score(0.0F, 0.0F);
  for (std::int32_t x = -kSteps; x <= kSteps; ++x) {
    for (std::int32_t y = -kSteps; y <= kSteps; ++y) {
      const Eigen::Vector2f slope(kStep * static_cast<float>(x), kStep * static_cast<float>(y));
      const std::uint32_t found = score(slope.x(), slope.y());
      if (found <= most) continue;
      most = found;
      best = slope;
    }
  }
  // A road uphill is level enough for columns of a metre.
  constexpr float kLeast = 0.08F;
  constexpr float kMostSlope = 0.3F;
  const float steepness = best.norm();
  return steepness >= kLeast && steepness <= kMostSlope ? best : Eigen::Vector2f::Zero();
}

void GroundAligner::collect(const PointView& points, const Pose& pose) noexcept {
  size_ = 0;
  const Eigen::Matrix3f r = pose.rotation.cast<float>();
  const auto floor_x = floor_to<std::int64_t>(pose.translation.x());
  const auto floor_y = floor_to<std::int64_t>(pose.translation.y());
  const auto within_x = static_cast<float>(pose.translation.x() - static_cast<double>(floor_x));
  const auto within_y = static_cast<float>(pose.translation.y() - static_cast<double>(floor_y));
  // Remainders suffice to tell columns of the map apart; far coordinates wrap.
  constexpr std::int32_t kRemainder = 0xFFFFFF;
  const auto column_x = static_cast<std::int32_t>(floor_x & kRemainder);
  const auto column_y = static_cast<std::int32_t>(floor_y & kRemainder);
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
    if (above_slope(q.x(), q.y(), q.z()) > -kBelow_m) continue;
    const std::int32_t x = (column_x + floor_to_int(within_x + q.x())) & kRemainder;
    const std::int32_t y = (column_y + floor_to_int(within_y + q.y())) & kRemainder;
    Column& column = columns_[(y & (kEdge - 1)) * kEdge + (x & (kEdge - 1))];
    if (column.x != x || column.y != y) column = {x, y, 0.0F, 0.0F, 0};
    constexpr std::uint32_t kFewestPoints = 1;
    const bool known = column.points >= kFewestPoints && column.scatter_m < kFlat_m;
    const std::int32_t block = (x >> kHalfBlock_log2_m) + (y >> kHalfBlock_log2_m);
    const auto half = static_cast<std::uint8_t>(known ? 1 + (block & 1) : 0);
    samples_[size_++] = {q.x(), q.y(), q.z(), &column, half};
  }
}

bool GroundAligner::measure_error(float sensor_height_m, Tilt& error) const noexcept {
  Tilt halves[2];
  if (!solve(sensor_height_m, 1, halves[0]) || !solve(sensor_height_m, 2, halves[1])) return false;
  error = {0.5 * (halves[0].about_x - halves[1].about_x),
           0.5 * (halves[0].about_y - halves[1].about_y), 0.5 * (halves[0].up_m - halves[1].up_m)};
  return true;
}

bool GroundAligner::solve(float sensor_height_m, std::uint8_t halves, Tilt& tilt) const noexcept {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  for (const double scale_m : kScales_m) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    std::uint32_t used = 0;
    for (std::uint32_t i = 0; i < size_; ++i) {
      const Sample& sample = samples_[i];
      if ((sample.half & halves) == 0) continue;
      // How the point rises with each parameter, and by how much it should.
      const double ax = static_cast<double>(sample.y_m + slope_.y() * sample.z_m);
      const double ay = -static_cast<double>(sample.x_m + slope_.x() * sample.z_m);
      const float height_m = sensor_height_m + above_slope(sample.x_m, sample.y_m, sample.z_m);
      const double missing_m = static_cast<double>(sample.column->height_m - height_m);
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
    const std::uint32_t parts = halves == kBothHalves ? 2 : 1;
    if (used < parts * kFewestGroundSamples) return false;
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
    const float height_m = shift_m + above_slope(sample.x_m, sample.y_m, sample.z_m) +
                           about_x * (sample.y_m + slope_.y() * sample.z_m) -
                           about_y * (sample.x_m + slope_.x() * sample.z_m);
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
