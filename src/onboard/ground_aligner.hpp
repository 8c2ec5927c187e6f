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
/// roll, pitch and height. The root mean square over the last scans is the noise of the attitude;
/// where it is more than free space can stand, poses are corrected.
class GroundAligner {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;
  void forget() noexcept;

  /// The pose of a scan, corrected if the noise asks for it. O(1): a bounded share of the points.
  [[nodiscard]] Pose align(const PointView& points, const Pose& T_odometry_sensor) noexcept;

  /// Root mean square of roll and pitch against the ground before, degrees; 0 = not known.
  [[nodiscard]] float noise_deg() const noexcept;
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
    bool known;  ///< the column's height is, and it is flat
  };
  /// Small rotations about the odometry's x and y axes, radians, and a shift along z, metres.
  struct Tilt {
    double about_x = 0.0;
    double about_y = 0.0;
    double up_m = 0.0;
  };

  struct Correction {
    Pose given;
    Pose used;
  };

  void collect(const PointView& points, const Pose& pose) noexcept;
  [[nodiscard]] bool solve(float sensor_height_m, Tilt& tilt) const noexcept;
  void add_to_map(float sensor_height_m, const Tilt& applied) noexcept;

  float range_min_m_ = 0.0F;
  double threshold_rad_ = 0.0;
  bool on_ = false;
  bool started_ = false;
  bool aligned_ = false;
  double base_m_ = 0.0;      ///< height from which heights count
  double variance_ = 0.0;    ///< of roll and pitch, rad²
  std::uint32_t scans_ = 0;  ///< measured, up to the span of the mean
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
