// Scenes of two maps with inter-session loops, for tests of alignment
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tests/merge/poses.hpp"
#include "tests/merge/random.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge::testing {

inline constexpr double kStepM = 5.0;
inline constexpr double kLoopSigmaM = 0.3;
inline constexpr double kLoopSigmaRad = 0.019;

/// A drive of `count` keyframes through town, 5 m apart, gentle bends and a turn now and then.
inline std::vector<Pose> drive(Random& random, std::size_t count, Pose pose) {
  std::vector<Pose> path;
  double turn_left = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    path.push_back(pose);
    if (i % 25 == 24) turn_left = random.uniform() < 0.5 ? -1.5708 : 1.5708;
    const double turn = std::clamp(turn_left, -0.4, 0.4);
    turn_left -= turn;
    pose = pose * yaw_pose(turn + 0.01 * random.normal(), {kStepM, 0.0, 0.0});
  }
  return path;
}

/// What odometry makes of true poses: drift 0.05 m and 0.11 degrees per 5 m, times `scale`, its own
/// origin.
inline std::vector<Pose> odometry(Random& random, const std::vector<Pose>& truth,
                                  double scale = 1.0) {
  std::vector<Pose> path{yaw_pose(random.uniform(-3.0, 3.0), random.normal3(100.0))};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    path.push_back(path.back() * truth[i - 1].inverse() * truth[i] *
                   random.pose(0.05 * scale, 0.0019 * scale));
  }
  return path;
}

struct Scene {
  double loop_sigma_m = kLoopSigmaM;  ///< noise of the loops that are added, which they know
  double loop_sigma_rad = kLoopSigmaRad;
  std::vector<std::vector<Pose>> truth;
  std::vector<AlignmentSession> sessions;
  std::vector<LoopConstraint> loops;
};

/// Central map of 1,500 m; the query shares 400 m of it and goes its own way for another 400 m.
inline Scene two_maps(Random& random) {
  Scene scene;
  const std::vector<Pose> central = drive(random, 300, Pose{});
  const std::size_t start = 60 + random.below(120);
  std::vector<Pose> query(central.begin() + static_cast<std::ptrdiff_t>(start),
                          central.begin() + static_cast<std::ptrdiff_t>(start + 80));
  const std::vector<Pose> own = drive(random, 81, query.back() * yaw_pose(1.5708, {0.0, 0.0, 0.0}));
  query.insert(query.end(), own.begin() + 1, own.end());
  for (auto& pose : query) pose = pose * yaw_pose(0.0, {0.0, 1.5, 0.0});
  scene.truth = {central, query};
  scene.sessions.push_back({odometry(random, central), 1.0});
  scene.sessions.push_back({odometry(random, query), 0.5});
  return scene;
}

inline void loop(Scene& scene, KeyframeId query, KeyframeId match, const Pose& T_match_query,
                 Random& random) {
  LoopConstraint& l = scene.loops.emplace_back();
  l.query = query;
  l.match = match;
  const double sigma_m = scene.loop_sigma_m;
  const double sigma_rad = scene.loop_sigma_rad;
  l.T_match_query = T_match_query * random.pose(sigma_m, sigma_rad);
  l.information.setZero();
  l.information.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / (sigma_m * sigma_m));
  l.information.bottomRightCorner<3, 3>().diagonal().setConstant(1.0 / (sigma_rad * sigma_rad));
  l.overlap = 0.5;
}

inline std::size_t nearest(const std::vector<Pose>& path, const Pose& pose) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (apart_m(path[i], pose) < apart_m(path[best], pose)) best = i;
  }
  return best;
}

/// The query seems to be `shift` beside where it is, in the frame of the match.
inline void add_true_loops(Scene& scene, std::size_t count, Random& random,
                           const Eigen::Vector3d& shift = Eigen::Vector3d::Zero()) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t q = i * 80 / count + random.below(80 / count);
    const std::size_t m = nearest(scene.truth[0], scene.truth[1][q]);
    Pose T_match_query = scene.truth[0][m].inverse() * scene.truth[1][q];
    T_match_query.translation += shift;
    loop(scene, {1, q}, {0, m}, T_match_query, random);
  }
}

inline void add_random_loops(Scene& scene, std::size_t count, Random& random) {
  for (std::size_t i = 0; i < count; ++i) {
    const Pose wrong = yaw_pose(random.uniform(-3.1, 3.1), random.normal3(2.0));
    loop(scene, {1, random.below(160)}, {0, random.below(300)}, wrong, random);
  }
}

/// Perceptual aliasing: a street that looks like another one gives consistent false loops along it.
inline void add_aliased_loops(Scene& scene, std::size_t count, Random& random) {
  const std::size_t q = 90 + random.below(40);
  const std::size_t m = 10 + random.below(250);
  const Pose T_map_query = scene.sessions[0].T_odometry_keyframe[m] *
                           yaw_pose(0.3, {1.0, 0.5, 0.0}) *
                           scene.sessions[1].T_odometry_keyframe[q].inverse();
  for (std::size_t i = 0; i < count; ++i) {
    const Pose seen = T_map_query * scene.sessions[1].T_odometry_keyframe[q + i];
    const std::size_t k = nearest(scene.sessions[0].T_odometry_keyframe, seen);
    // The keyframes need not be neighbours for the loops to agree with each other.
    loop(scene, {1, q + i}, {0, k}, scene.sessions[0].T_odometry_keyframe[k].inverse() * seen,
         random);
  }
}

/// RMS over the shared part of how far the query's keyframes are from where they belong,
/// relative to the central keyframes beside them.
inline double overlap_error_m(const Scene& scene, const Alignment& alignment) {
  double sum = 0.0;
  for (std::size_t q = 0; q < 80; ++q) {
    const std::size_t m = nearest(scene.truth[0], scene.truth[1][q]);
    const Pose truth = scene.truth[0][m].inverse() * scene.truth[1][q];
    const Pose estimate =
        alignment.T_map_keyframe({0, m}).inverse() * alignment.T_map_keyframe({1, q});
    sum += (truth.translation - estimate.translation).squaredNorm();
  }
  return std::sqrt(sum / 80.0);
}

/// How far a loop is from what alignment made of it.
inline double chi2_after(const Alignment& alignment, const LoopConstraint& loop) {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  graph.nodes.push_back({alignment.T_map_keyframe(loop.match), 0, true});
  graph.nodes.push_back({alignment.T_map_keyframe(loop.query), 0, false});
  return edge_chi2(graph, {0, 1, loop.T_match_query, loop.information, 0.0});
}

/// So loose that alignment keeps every loop of `two_maps`.
inline MergeConfig loose_config() {
  MergeConfig config;
  config.acceptance.consistency_chi2 = 200.0;
  config.acceptance.loop_chi2 = 1000.0;
  return config;
}

/// The loop that agrees least with what alignment made of it.
inline std::size_t worst_loop(const Alignment& alignment, const Scene& scene) {
  std::size_t worst = 0;
  for (std::size_t i = 1; i < scene.loops.size(); ++i) {
    if (chi2_after(alignment, scene.loops[i]) > chi2_after(alignment, scene.loops[worst])) {
      worst = i;
    }
  }
  return worst;
}

/// Every loop pulls as hard as it can, and maps may bend as they like.
inline MergeConfig pulling_config() {
  MergeConfig config;
  config.acceptance.consistency_chi2 = 1e9;
  config.graph.cauchy_scale = 1e6;
  config.graph.deformation_floor_m = 1000.0;
  return config;
}

inline Alignment align(const Scene& scene, const MergeConfig& config = {},
                       const PlacementCheck& check = {}) {
  return align_sessions(scene.sessions, scene.loops, config, check);
}

inline double apart_m(const Alignment& alignment, KeyframeId a, KeyframeId b) {
  return apart_m(alignment.T_map_keyframe(a), alignment.T_map_keyframe(b));
}

/// Poses straight ahead, `kStepM` apart.
inline std::vector<Pose> straight(std::size_t count) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) poses.push_back(shifted(kStepM * static_cast<double>(i)));
  return poses;
}

/// Sessions of so many keyframes along one street; the first is the most central.
inline Scene beside_each_other(const std::vector<std::size_t>& keyframes) {
  Scene scene;
  for (const std::size_t count : keyframes) {
    const double score = 1.0 / static_cast<double>(1 + scene.sessions.size());
    scene.sessions.push_back({straight(count), score});
  }
  return scene;
}

/// A measurement without noise, weighed as if it had a standard deviation of `sigma`.
inline LoopConstraint exact_loop(KeyframeId query, KeyframeId match, const Pose& T_match_query = {},
                                 double sigma = kLoopSigmaM) {
  LoopConstraint l;
  l.query = query;
  l.match = match;
  l.T_match_query = T_match_query;
  l.information = Matrix6d::Identity() / (sigma * sigma);
  l.overlap = 0.9;
  return l;
}

/// Inter-session loops of two sessions that drive the same way, one every `step` keyframes.
inline void connect_side_by_side(std::vector<LoopConstraint>& loops, std::size_t query,
                                 std::size_t match, std::size_t keyframes, std::size_t step = 2) {
  for (std::size_t k = 0; k < keyframes; k += step) {
    loops.push_back(exact_loop({query, k}, {match, k}));
  }
}

/// Ten loops along the first session, each over two steps, and the odometry of a session that is
/// ten metres longer at each of the first `longer` of them.
inline std::vector<Pose> contradict_ten_loops(Scene& scene, std::size_t longer) {
  for (std::size_t j = 0; j < 10; ++j) {
    scene.loops.push_back(exact_loop({0, 4 * j + 2}, {0, 4 * j}, shifted(2.0 * kStepM)));
  }
  std::vector<Pose> poses = straight(41);
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const bool stretched = (k - 1) / 4 < longer && (k - 1) % 4 < 2;
    poses[k].translation.x() = poses[k - 1].translation.x() + (stretched ? 2.0 : 1.0) * kStepM;
  }
  return poses;
}

}  // namespace unimapper::merge::testing
