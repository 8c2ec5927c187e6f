// Orientation of the sensor on the body, motion of the body, attitude noise of the odometry.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry.hpp"
#include "simulate.hpp"

namespace unimapper::simulator {

/// T_body_sensor; both origins coincide.
Frame mount_frame(const Mount& mount);

/// Body that rolls and pitches with one frequency and a phase each.
class SwayingBody {
 public:
  SwayingBody(const Sway& sway, std::uint64_t key);
  /// T_level_body at a time.
  [[nodiscard]] Frame at(double time_s) const;

 private:
  Sway sway_;
  double roll_phase_, pitch_phase_;
};

/// Rotates all poses T_odometry_points but the first by noise about the body's x and y axes; the
/// poses are `interval_s` apart. T_body_points says where the axes are.
void add_attitude_noise(const AttitudeNoise& noise, double interval_s, const Frame& T_body_points,
                        std::uint64_t key, std::vector<Frame>& poses);

}  // namespace unimapper::simulator
