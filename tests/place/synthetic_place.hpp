// Synthetic scene: blocks, posts and ground, observed from any pose.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/random.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::test {

struct Surface {
  Eigen::Vector3d corner, along, up;  ///< a rectangle: corner + [0,1] along + [0,1] up
  bool ground;
};

/// Surfaces around the world's origin.
std::vector<Surface> make_scene(std::uint64_t seed);
/// The same scene seen in a mirror that stands upright.
std::vector<Surface> mirrored(std::vector<Surface> surfaces);
/// The same scene, moved and turned as a whole.
std::vector<Surface> moved(std::vector<Surface> surfaces, const Pose& T_new_old);

struct View {
  std::uint64_t noise_seed = 1;
  double spacing_m = 0.11;  ///< between points on a surface
  double noise_m = 0.01;
  double range_m = 55.0;
  bool mark_ground = true;
  Eigen::Vector3d grid_shift = Eigen::Vector3d::Zero();
};

/// What a sensor at `T_world_sensor` gathers: fine cells in its levelled frame.
std::vector<FineCell> observe(const std::vector<Surface>& surfaces, const Pose& T_world_sensor,
                              const View& view = {});

/// A pose at (x, y) `height` above the world's z = 0.
Pose standing_at(double x, double y, double height, double yaw_rad);

}  // namespace unimapper::test
