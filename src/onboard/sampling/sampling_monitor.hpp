// Range images that follow the sampling of the sensor as it is measured
#pragma once

#include <cstdint>

#include "sampling_estimator.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::onboard {

/// Measures the first scan and then one scan of every few keyframes, and tells which image shape
/// and range of full weight suit the sensor. The preset holds as long as what is measured is about
/// what it assumed; else the measurement does, within the pixels there is room for. Another mode
/// must be measured twice in a row.
class SamplingMonitor {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// To be called before the first scan of each keyframe. O(1).
  void begin() noexcept;
  /// A slice of measuring that scan, if it is due (`SamplingEstimator::step`). False once it is
  /// done, or none was due.
  bool step(const PointView& points) noexcept;
  /// Whether the scan of the next `begin` will be measured.
  [[nodiscard]] bool is_due() const noexcept { return measures_rays_ && until_next_ == 0; }
  /// Whether the last scan changed `free_space()`, once it was measured.
  [[nodiscard]] bool has_changed() const noexcept { return changed_; }
  /// To be called with the pose of each scan of the keyframe.
  void add_pose(const Pose& T_odometry_sensor) noexcept;
  /// To be called with the last scan of the keyframe: whether rays that left the field of view say
  /// something of the sensor. Sweeps of a sensor that sways reach beyond it by as much as it turns
  /// in a sweep, once they are motion-compensated. True if that was decided just now.
  bool close() noexcept;

  /// The configuration with the shape and the range of full weight that hold now.
  [[nodiscard]] const FreeSpaceConfig& free_space() const noexcept { return free_space_; }
  [[nodiscard]] const SamplingStatistics& statistics() const noexcept { return statistics_; }

  /// Pixels an image may have.
  [[nodiscard]] static std::size_t max_pixels(const FreeSpaceConfig& config) noexcept;

 private:
  static constexpr std::uint32_t kKeyframesBetween = 4;

  void follow_sampling(const Sampling& measured) noexcept;
  bool follow_elevations(float min_deg, float max_deg) noexcept;
  /// Derives `free_space_`; false if it stays as it was.
  bool update() noexcept;

  KeyframeConfig keyframe_;
  FreeSpaceConfig config_;  ///< as given
  FreeSpaceConfig free_space_;
  float fine_size_m_ = 0.2F;
  bool measures_rays_ = false;
  bool measuring_ = false;
  bool changed_ = false;
  SamplingEstimator estimator_;
  std::uint32_t until_next_ = 0;  ///< keyframes
  Sampling current_;              ///< 0: not known yet
  Sampling pending_;              ///< another sampling, measured once
  float elevation_min_deg_ = 0.0F;
  float elevation_max_deg_ = 0.0F;
  float beyond_deg_ = 0.0F;  ///< rays left the field of view by so much; 0: decided upon
  float turn_deg_ = 0.0F;    ///< largest tilt from scan to scan in this keyframe
  std::uint32_t poses_ = 0;  ///< in this keyframe
  Eigen::Matrix3d rotation_before_ = Eigen::Matrix3d::Identity();
  SamplingStatistics statistics_;
};

}  // namespace unimapper::onboard
