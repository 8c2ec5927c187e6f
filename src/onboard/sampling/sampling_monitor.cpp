#include "sampling_monitor.hpp"

#include <algorithm>

namespace unimapper::onboard {
namespace {

/// Modes of one sensor differ by a factor of two; uneven rings and missing returns by less than
/// this.
bool differs(float a, float b) noexcept { return a > 1.4F * b || b > 1.4F * a; }
constexpr float kBeyond_deg = 1.5F;  ///< a few rays may leave the image
bool differs(const Sampling& a, const Sampling& b) noexcept {
  return differs(a.azimuth_deg, b.azimuth_deg) || differs(a.elevation_deg, b.elevation_deg);
}

/// Lowers the resolution until an image fits; false if it does not at the lowest.
bool fit(std::size_t max_pixels, FreeSpaceConfig& free_space) noexcept {
  constexpr std::uint32_t kMostSteps = 8;
  for (std::uint32_t step = 0; step < kMostSteps; ++step) {
    const std::size_t pixels = ImageProjection(free_space.image_shape()).pixels();
    if (pixels <= max_pixels) return true;
    const float excess = 1.02F * static_cast<float>(pixels) / static_cast<float>(max_pixels);
    float& resolution_deg = free_space.elevation_resolution_deg < 2.0F
                                ? free_space.elevation_resolution_deg
                                : free_space.azimuth_resolution_deg;
    resolution_deg = std::min(resolution_deg * std::min(excess, 2.0F), kCoarsestPixelDeg);
  }
  return false;
}

}  // namespace

std::size_t SamplingMonitor::max_pixels(const FreeSpaceConfig& config) noexcept {
  return std::max<std::size_t>(ImageProjection(config.image_shape()).pixels(),
                               config.max_image_pixels);
}

void SamplingMonitor::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  keyframe_ = config.keyframe;
  config_ = free_space_ = config.free_space;
  fine_size_m_ = config.voxel.fine_size_m;
  measures_rays_ = config_.visibility && config_.ray_spacing_deg > 0.0F;
  elevation_min_deg_ = config_.elevation_min_deg;
  elevation_max_deg_ = config_.elevation_max_deg;
  statistics_.image_elevation_min_deg = config_.elevation_min_deg;
  statistics_.image_elevation_max_deg = config_.elevation_max_deg;
  if (measures_rays_) estimator_.allocate(arena);
}

void SamplingMonitor::begin() noexcept {
  changed_ = false;
  if (!measures_rays_) return;
  poses_ = 0;
  turn_deg_ = 0.0F;
  measuring_ = is_due();
  until_next_ = measuring_ ? kKeyframesBetween - 1 : until_next_ - 1;
  if (measuring_) estimator_.begin();
}

bool SamplingMonitor::step(const PointView& points) noexcept {
  if (!measuring_) return false;
  PointView fitting = points;
  fitting.count = std::min<std::size_t>(points.count, keyframe_.max_points_per_scan);
  if (estimator_.step(fitting, keyframe_.range_min_m, keyframe_.range_max_m)) return true;
  measuring_ = false;
  const SamplingEstimate& estimate = estimator_.estimate();
  if (estimate.valid) follow_sampling(estimate.sampling);
  const bool wider = follow_elevations(estimate.elevation_min_deg, estimate.elevation_max_deg);
  changed_ = (estimate.valid || wider) && update();
  return false;
}

void SamplingMonitor::add_pose(const Pose& T_odometry_sensor) noexcept {
  if (!measures_rays_) return;
  if (poses_ > 0) {
    // Entries of the rotation between both, whose differences are twice the sines of the turns
    // about the sensor's own x and y axes.
    const auto entry = [&](int row, int column) noexcept {
      return rotation_before_.col(row).dot(T_odometry_sensor.rotation.col(column));
    };
    const Eigen::Vector2d tilt(entry(2, 1) - entry(1, 2), entry(0, 2) - entry(2, 0));
    turn_deg_ = std::max(turn_deg_, static_cast<float>(0.5 * kDegreesPerRadian * tilt.norm()));
  }
  rotation_before_ = T_odometry_sensor.rotation;
  ++poses_;
}

bool SamplingMonitor::close() noexcept {
  // One scan tells nothing of how the sensor moves: the next keyframe decides.
  if (poses_ < 2) return false;
  const bool differ = beyond_deg_ > kBeyond_deg + turn_deg_;
  const bool is_new = differ && !statistics_.elevations_differ;
  statistics_.elevations_differ |= differ;
  beyond_deg_ = 0.0F;
  return is_new;
}

void SamplingMonitor::follow_sampling(const Sampling& measured) noexcept {
  const bool known = current_.azimuth_deg > 0.0F;
  if (known && !differs(measured, current_)) {
    pending_ = {};
    return;
  }
  const bool agrees = pending_.azimuth_deg > 0.0F && !differs(measured, pending_);
  if (known && !agrees) {
    pending_ = measured;
    until_next_ = 0;
    return;
  }
  if (known) ++statistics_.changes;
  current_ = measured;
  pending_ = {};
  statistics_.ray_spacing_deg = measured.azimuth_deg;
  statistics_.ring_spacing_deg = measured.elevation_deg;
}

bool SamplingMonitor::follow_elevations(float min_deg, float max_deg) noexcept {
  beyond_deg_ = std::max(
      {beyond_deg_, config_.elevation_min_deg - min_deg, max_deg - config_.elevation_max_deg});
  constexpr float kSlack_deg = 1.5F;  // for the next scans
  bool wider = false;
  if (min_deg < elevation_min_deg_ - kBeyond_deg) {
    elevation_min_deg_ = std::max(min_deg - kSlack_deg, -90.0F);
    wider = true;
  }
  if (max_deg > elevation_max_deg_ + kBeyond_deg) {
    elevation_max_deg_ = std::min(max_deg + kSlack_deg, 90.0F);
    wider = true;
  }
  return wider;
}

bool SamplingMonitor::update() noexcept {
  FreeSpaceConfig next = config_;
  const Sampling assumed{config_.ray_spacing_deg, config_.ring_spacing_deg};
  const bool other_rays = current_.azimuth_deg > 0.0F && differs(current_, assumed);
  if (other_rays) apply_sampling(current_, fine_size_m_, next);
  next.elevation_min_deg = elevation_min_deg_;
  next.elevation_max_deg = elevation_max_deg_;
  if (!fit(max_pixels(config_), next)) return false;
  statistics_.rays_differ = other_rays;
  statistics_.image_elevation_min_deg = elevation_min_deg_;
  statistics_.image_elevation_max_deg = elevation_max_deg_;
  const bool changed = next.image_shape() != free_space_.image_shape() ||
                       next.full_weight_range_m != free_space_.full_weight_range_m;
  free_space_ = next;
  return changed;
}

}  // namespace unimapper::onboard
