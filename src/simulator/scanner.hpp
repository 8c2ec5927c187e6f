// Sensor model of one sweep: rolling shutter, beam footprint, glass, detection, noise.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "lidar.hpp"
#include "raycast.hpp"

namespace unimapper::simulator {

/// A return as the sensor reports it: in its own frame at the time of the shot.
struct LidarReturn {
  Vec3 point;
  float time;       ///< 0 at the start of the sweep, 1 at its end
  float intensity;  ///< 0..1
  std::uint16_t label, object;
  std::uint16_t ring;  ///< number of the laser
};

/// Sensor frames spread evenly over a sweep, first at its start, last at its end.
using SweepFrames = std::vector<Frame>;

/// Frame at `time` (0..1) between the entries of `frames`.
Frame interpolate(const SweepFrames& frames, double time);

class Scanner {
 public:
  /// `key` seeds all noise; every ray draws from its own stream.
  Scanner(const LidarModel& model, const Caster& caster, std::uint64_t key)
      : model_(model), caster_(caster), key_(key) {}

  /// Appends the returns of sweep `scan` in the order of `rays`.
  void scan(std::uint32_t scan, const std::vector<PatternRay>& rays, const SweepFrames& frames,
            std::vector<LidarReturn>& returns);

 private:
  struct Echo {
    double range;     ///< metres; negative: none
    double strength;  ///< signal relative to the detection limit's 10 % target
    float intensity;
    std::uint16_t label, object;
  };

  void aim(std::uint32_t scan, const std::vector<PatternRay>& rays, const SweepFrames& frames);
  void see_through_glass(std::uint64_t ray_key, RayQuery& query, RayHit& hit, double& pass) const;
  [[nodiscard]] Echo echo_of(const RayHit& hit, double pass, double leaf_factor) const;
  static Echo combined(const Echo& a, const Echo& b, double weight);

  const LidarModel& model_;
  const Caster& caster_;
  std::uint64_t key_;
  // Kept from sweep to sweep.
  std::vector<RayQuery> queries_;
  std::vector<RayHit> hits_;
  std::vector<RayQuery> second_queries_;
  std::vector<RayHit> second_hits_;
  std::vector<std::uint32_t> second_of_;
};

}  // namespace unimapper::simulator
