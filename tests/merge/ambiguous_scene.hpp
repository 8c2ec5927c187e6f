// False loops that are plausible: a floor above, a lap that closes 10 m off
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "tests/merge/alignment_scene.hpp"
#include "unimapper/core/rigid_fit.hpp"

namespace unimapper::merge::testing {

/// Like `add_true_loops`, but the query seems to be `shift` beside where it is, in the frame of
/// the match: a floor above that looks like this one.
inline void add_shifted_loops(Scene& scene, std::size_t count, const Eigen::Vector3d& shift,
                              Random& random) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t q = i * 80 / count + random.below(80 / count);
    const std::size_t m = nearest(scene.truth[0], scene.truth[1][q]);
    Pose T_match_query = scene.truth[0][m].inverse() * scene.truth[1][q];
    T_match_query.translation += shift;
    loop(scene, {1, q}, {0, m}, T_match_query, random);
  }
}

inline constexpr std::size_t kLapKeyframes = 160;

/// One session on a circle, back at its start after 800 m and 40 m beyond it; odometry
/// `odometry_scale` times as noisy as `odometry` makes it.
inline Scene lap(Random& random, double odometry_scale) {
  constexpr double kRadius = 127.3;
  std::vector<Pose> truth;
  for (std::size_t i = 0; i < kLapKeyframes + 8; ++i) {
    const double turn =
        2.0 * 3.14159265 * static_cast<double>(i) / static_cast<double>(kLapKeyframes);
    truth.push_back(
        yaw_pose(turn, {kRadius * std::sin(turn), kRadius * (1.0 - std::cos(turn)), 0.0}));
  }
  Scene scene;
  scene.sessions.push_back({odometry(random, truth, odometry_scale), 1.0});
  scene.truth.push_back(std::move(truth));
  return scene;
}

/// A loop that closes the lap 10 m off, in a horizontal direction of its own.
inline void add_false_intra_loop(Scene& scene, Random& random) {
  const double direction = random.uniform(-3.14159, 3.14159);
  const Eigen::Vector3d off(10.0 * std::cos(direction), 10.0 * std::sin(direction), 0.0);
  loop(scene, {0, kLapKeyframes}, {0, 0}, yaw_pose(0.0, off), random);
}

/// True loops that close the lap, one at each keyframe beyond its end.
inline void add_true_intra_loops(Scene& scene, std::size_t count, Random& random) {
  for (std::size_t i = 0; i < count; ++i) {
    loop(scene, {0, kLapKeyframes + 1 + i}, {0, 1 + i}, Pose{}, random);
  }
}

/// Absolute trajectory error (RMSE) of a session after the best rigid fit to its truth, metres.
inline double trajectory_error_m(const std::vector<Pose>& truth, const std::vector<Pose>& poses) {
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    pairs.push_back({poses[i].translation, truth[i].translation});
  }
  Pose T_truth_poses;
  if (!fit_rigid(pairs, T_truth_poses)) return 0.0;
  double sum = 0.0;
  for (const PointPair& pair : pairs) sum += (T_truth_poses * pair.a - pair.b).squaredNorm();
  return std::sqrt(sum / static_cast<double>(pairs.size()));
}

}  // namespace unimapper::merge::testing
