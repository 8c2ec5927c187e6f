// LiDAR models: scan patterns and detection parameters.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::simulator {

/// One shot in the sensor frame.
struct PatternRay {
  Vec3 origin, direction;
  float time;           ///< 0 at the start of the sweep, 1 at its end
  std::uint32_t index;  ///< running number in the full pattern, whatever the thinning
  std::uint16_t ring;   ///< as the sensor's driver numbers its lasers
};

/// Detection figures of one LiDAR, from data sheets and published measurements.
struct LidarModel {
  SensorKind kind;
  double range_min_m, range_max_m;
  double range_10_m;      ///< 90 % detection of a 10 % target
  double range_sigma_m;   ///< at a strong echo, one sigma
  double divergence_rad;  ///< full width
};

/// Columns and rings of a spinning LiDAR where they differ from the sensor's own.
struct Sampling {
  std::uint32_t columns = 0;  ///< per turn; 0: the sensor's
  std::uint32_t rings = 0;    ///< evenly spaced in the sensor's field of view; 0: the sensor's
  /// Half of the rings within a quarter of the field of view around the horizon, as sensors for
  /// cars have them; the others three times as far apart.
  bool uneven_rings = false;

  [[nodiscard]] bool is_own() const { return columns == 0 && rings == 0 && !uneven_rings; }
};

/// Throws std::runtime_error for a sensor the simulator has no pattern of.
LidarModel lidar_model(SensorKind kind);

/// True for sensors with rings that turn about an axis.
bool is_spinning(SensorKind kind);

/// Rays of the sweep that starts at `start_s`; keeps every `thin`-th column (spinning) or shot.
/// Livox patterns run on from sweep to sweep and never repeat. `sampling` is for spinning sensors.
void make_pattern(SensorKind kind, double start_s, std::uint32_t thin,
                  std::vector<PatternRay>& rays, const Sampling& sampling = {});

/// True if the pattern is the same in every sweep.
bool repeats(SensorKind kind);

inline constexpr double kSweepSeconds = 0.1;

}  // namespace unimapper::simulator
