// False loops that are plausible: a floor above, a bore, a lap that closes 10 m off
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "src/core/rigid_fit.hpp"
#include "tests/merge/alignment_scene.hpp"

namespace unimapper::merge::testing {

/// Two drives through a straight tunnel of 36 keyframes (175 m), the second 1.5 m beside the first.
inline Scene tunnel(Random& random) {
  Scene scene;
  std::vector<Pose> query = straight(36);
  for (Pose& pose : query) pose = pose * shifted(0.0, 1.5);
  scene.truth = {straight(36), query};
  scene.sessions = {{odometry(random, scene.truth[0]), 1.0},
                    {odometry(random, scene.truth[1]), 0.5}};
  return scene;
}

/// True loops at the portals, the first three and the last three keyframes; between them one loop a
/// keyframe that is wrong along the bore: by `common_m`, and evenly by up to `scatter_m` either
/// way. Those claim the deviation `along_m` along the bore.
inline void add_tunnel_loops(Scene& scene, double common_m, double scatter_m, double along_m,
                             Random& random) {
  const std::size_t count = scene.truth[1].size();
  for (std::size_t k = 0; k < count; ++k) {
    Pose T_match_query = scene.truth[0][k].inverse() * scene.truth[1][k];
    const bool is_portal = k < 3 || k + 3 >= count;
    if (!is_portal) {
      T_match_query.translation.x() += common_m + random.uniform(-scatter_m, scatter_m);
    }
    loop(scene, {1, k}, {0, k}, T_match_query, random);
    if (!is_portal) scene.loops.back().information(0, 0) = 1.0 / (along_m * along_m);
  }
}

/// Root mean square over all keyframes of how far the second session is from where it belongs,
/// seen from the first one's keyframe beside it, metres.
inline double side_by_side_error_m(const Scene& scene, const Alignment& alignment) {
  double sum = 0.0;
  const std::size_t count = scene.truth[1].size();
  for (std::size_t k = 0; k < count; ++k) {
    const Pose truth = scene.truth[0][k].inverse() * scene.truth[1][k];
    const Pose estimate =
        alignment.T_map_keyframe({0, k}).inverse() * alignment.T_map_keyframe({1, k});
    sum += (truth.translation - estimate.translation).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(count));
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
