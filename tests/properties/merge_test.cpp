// Equivariance of the merge under rigid transforms of its input
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "src/merge/graph/alignment_problem.hpp"
#include "src/merge/graph/map_graph.hpp"
#include "src/merge/loops/loop_acceptance.hpp"
#include "src/merge/loops/radius_search.hpp"
#include "src/merge/map/changes.hpp"
#include "src/merge/map/voxel_trees.hpp"
#include "src/merge/registration/registration.hpp"
#include "src/merge/sessions/central_score.hpp"
#include "src/merge/sessions/seen_extent.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/regression/tilted_scenes.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/keyframe_level.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::regression;

namespace {

double distance_m(const Pose& a, const Pose& b) { return (a.translation - b.translation).norm(); }
double angle_deg(const Pose& a, const Pose& b) {
  return rotation_angle(a.rotation.transpose() * b.rotation) * kDegreesPerRadian;
}

void check_same_pose(const Pose& a, const Pose& b, double metres, double degrees) {
  CHECK(distance_m(a, b) <= metres);
  CHECK(angle_deg(a, b) <= degrees);
}

std::vector<Pose> moved(const Pose& T_new_old, std::vector<Pose> poses) {
  for (Pose& pose : poses) pose = T_new_old * pose;
  return poses;
}

std::vector<Eigen::Vector3f> moved(const Pose& T_new_old, std::vector<Eigen::Vector3f> points) {
  for (auto& p : points) p = (T_new_old * Eigen::Vector3d(p.cast<double>())).cast<float>();
  return points;
}

Pose yaw_only(Random& random, double extent_m) {
  const double yaw = random.uniform(-170.0, 170.0);
  const double x = random.uniform(-extent_m, extent_m);
  const double y = random.uniform(-extent_m, extent_m);
  return turned(0.0, 0.0, yaw, {x, y, random.uniform(-10.0, 10.0)});
}

}  // namespace

TEST_CASE("sets of consistent loops do not depend on the sessions' frames", "[frames]") {
  Random random(2);
  const Sessions s = three_sessions(51);
  std::vector<LoopConstraint> loops;
  for (const LoopConstraint& loop : s.loops) {
    if (loop.query.session == 1 && loop.match.session == 0) loops.push_back(loop);
  }
  const AcceptanceConfig config;
  const auto set_of = [&](const Pose& query, const Pose& match) {
    return inter_session_consistency(
        loops, SessionPath(moved(query, s.sessions[1].T_odometry_keyframe), some_noise()),
        SessionPath(moved(match, s.sessions[0].T_odometry_keyframe), some_noise()), config);
  };
  const ConsistencySet before = set_of({}, {});
  REQUIRE(before.state == PairState::kConfirmed);
  REQUIRE(before.inliers.size() < loops.size());
  for (int round = 0; round < 4; ++round) {
    const Pose query = any_pose(random, 90.0);
    const Pose match = any_pose(random, 90.0);
    const ConsistencySet after = set_of(query, match);
    CHECK(after.inliers == before.inliers);
    CHECK(after.distinct == before.distinct);
    CHECK(after.competing == before.competing);
    check_same_pose(after.T_match_session_query_session,
                    match * before.T_match_session_query_session * query.inverse(), 1e-6, 1e-6);
  }
}

TEST_CASE("a loop turned round twice is the same loop, and explains the same poses as well",
          "[frames]") {
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    LoopConstraint loop;
    loop.query = {1, 4};
    loop.match = {0, 7};
    loop.T_match_query = any_pose(random, 12.0);
    loop.information = any_information(random, 0.2, 0.02);
    const LoopConstraint back = flipped(loop);
    const LoopConstraint again = flipped(back);
    CHECK(back.query == loop.match);
    check_same_pose(again.T_match_query, loop.T_match_query, 1e-9, 1e-9);
    CHECK((again.information - loop.information).norm() < 1e-6 * loop.information.norm());
    // An error of the relative pose that is small: both directions weigh it alike.
    PoseGraph graph;
    graph.anchors = {{any_pose(random, 5.0), true}};
    graph.nodes = {{any_pose(random, 30.0), 0, true}, {}};
    graph.nodes[1].T_session_node =
        graph.nodes[0].T_session_node * loop.T_match_query * random.pose(1e-3, 1e-4);
    const double forth = edge_chi2(graph, {0, 1, loop.T_match_query, loop.information, 0.0});
    const double backwards = edge_chi2(graph, {1, 0, back.T_match_query, back.information, 0.0});
    CHECK(backwards == Approx(forth).epsilon(0.01));
  }
}

TEST_CASE("alignment gives the same relative poses whatever the sessions' frames", "[frames]") {
  Random random(4);
  const Sessions s = three_sessions(52);
  MergeConfig config;
  config.odometry = some_noise();
  const std::span<const LoopConstraint> all(s.loops);
  const auto run = [&](const std::vector<AlignmentSession>& sessions) {
    const Alignment first = align_sessions(sessions, all.first(all.size() - 5), config);
    return refine_alignment(first, sessions, all, config);
  };
  const Alignment before = run(s.sessions);
  REQUIRE(before.connected == std::vector<bool>{true, true, true});
  for (int round = 0; round < 2; ++round) {
    std::vector<AlignmentSession> sessions = s.sessions;
    std::vector<Pose> frames;
    for (AlignmentSession& session : sessions) {
      frames.push_back(any_pose(random, 120.0));
      session.T_odometry_keyframe = moved(frames.back(), session.T_odometry_keyframe);
    }
    const Alignment after = run(sessions);
    REQUIRE(after.central == before.central);
    CHECK(after.connected == before.connected);
    for (std::size_t i = 0; i < all.size(); ++i) {
      CHECK(after.decisions[i].accepted == before.decisions[i].accepted);
      CHECK(after.decisions[i].reason == before.decisions[i].reason);
    }
    const Pose& central = frames[before.central];
    for (std::size_t i = 0; i < 3; ++i) {
      check_same_pose(after.T_map_session[i],
                      central * before.T_map_session[i] * frames[i].inverse(), 2e-3, 2e-3);
      for (std::size_t k = 0; k < s.truth[i].size(); k += 6) {
        check_same_pose(after.T_map_keyframe({i, k}), central * before.T_map_keyframe({i, k}), 2e-3,
                        2e-3);
      }
    }
  }
}

TEST_CASE("registration follows the frames of both clouds", "[frames]") {
  Random random(6);
  const RegistrationConfig config;
  const Pose T_world_target = turned(1.0, -1.0, 20.0, {0.5, -0.5, 1.5});
  const Pose T_world_source = turned(-2.0, 1.0, 50.0, {-1.0, 0.5, 1.3});
  const Corner a = corner(random, T_world_target.inverse(), 0.01);
  const Corner b = corner(random, T_world_source.inverse(), 0.01);
  const Pose truth = T_world_target.inverse() * T_world_source;
  const Pose start = truth * turned(0.5, -0.5, 2.0, {0.3, -0.3, 0.1});
  const RegistrationCloud target(a.points, a.ground, config);
  const RegistrationCloud source(b.points, b.ground, config);
  const RegistrationResult before = register_clouds(target, source, start, config);
  REQUIRE(before.converged);
  check_same_pose(before.T_target_source, truth, 0.03, 0.3);
  for (int round = 0; round < 3; ++round) {
    const Pose turn_target = any_pose(random, 3.0);
    const Pose turn_source = any_pose(random, 3.0);
    const RegistrationCloud other_target(moved(turn_target, a.points), a.ground, config);
    const RegistrationCloud other_source(moved(turn_source, b.points), b.ground, config);
    const Pose other_truth = turn_target * truth * turn_source.inverse();
    const RegistrationResult after = register_clouds(
        other_target, other_source, turn_target * start * turn_source.inverse(), config);
    CHECK(after.converged);
    // Thinning follows the axes of the frame: the same surfaces, but other points of them.
    check_same_pose(after.T_target_source, other_truth, 0.03, 0.3);
    CHECK(after.rmse_m == Approx(before.rmse_m).epsilon(0.15));
    // The covariance of the translation is that of before, in the target's other axes.
    const Eigen::Matrix3d r = turn_target.rotation;
    const Eigen::Matrix3d expected =
        r * before.information.inverse().topLeftCorner<3, 3>() * r.transpose();
    const Eigen::Matrix3d found = after.information.inverse().topLeftCorner<3, 3>();
    CHECK(structure_overlap(other_target, other_source, other_truth, 40.0, 0.5) ==
          Approx(structure_overlap(target, source, truth, 40.0, 0.5)).margin(0.05));
    CHECK((found - expected).norm() < 0.35 * expected.norm());
  }
}

TEST_CASE("keyframes near each other are the same in a map that is turned as a whole", "[frames]") {
  Random random(7);
  const Sessions s = three_sessions(53);
  std::vector<SessionData> sessions(3);
  Alignment alignment;
  alignment.connected = {true, true, true};
  for (std::size_t i = 0; i < 3; ++i) {
    sessions[i].info.sensor = i == 0 ? "livox-avia" : "aeva-aeries2";
    for (const Pose& pose : s.sessions[i].T_odometry_keyframe) {
      sessions[i].keyframes.emplace_back().T_odometry_keyframe = pose;
    }
    alignment.T_map_session.push_back(any_pose(random, 20.0));
    alignment.T_session_keyframe.push_back(moved(alignment.T_map_session[i].inverse(), s.truth[i]));
  }
  const auto before = find_radius_candidates(sessions, alignment, {}, MergeConfig{});
  REQUIRE(before.size() > 5);
  const Pose turn = any_pose(random, 100.0);
  for (Pose& pose : alignment.T_map_session) pose = turn * pose;
  const auto after = find_radius_candidates(sessions, alignment, {}, MergeConfig{});
  REQUIRE(after.size() == before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    CHECK(after[i].query == before[i].query);
    CHECK(after[i].match == before[i].match);
    check_same_pose(after[i].T_match_query, before[i].T_match_query, 1e-9, 1e-9);
    // What the poses say, and no inverse of it.
    const KeyframeId q = before[i].query;
    const KeyframeId m = before[i].match;
    check_same_pose(before[i].T_match_query,
                    s.truth[m.session][m.keyframe].inverse() * s.truth[q.session][q.keyframe], 1e-9,
                    1e-9);
  }
}

namespace {

/// Quarter turns and whole cells: the map's grid lies on itself again.
Pose grid_motion(int quarter_turns, const Eigen::Vector3d& whole_metres) {
  Pose pose;
  const double c[] = {1.0, 0.0, -1.0, 0.0};
  const double s[] = {0.0, 1.0, 0.0, -1.0};
  const int q = quarter_turns % 4;
  pose.rotation << c[q], -s[q], 0.0, s[q], c[q], 0.0, 0.0, 0.0, 1.0;
  pose.translation = whole_metres;
  return pose;
}

std::size_t count_dynamic(const std::vector<PosedSession>& posed,
                          const std::vector<std::vector<RefinedKeyframe>>& refined) {
  std::size_t count = 0;
  const auto add = [&](const FineCell&) { ++count; };
  for (std::size_t s = 0; s < posed.size(); ++s) {
    for (std::size_t k = 0; k < refined[s].size(); ++k) {
      visit_cells(posed[s].session->keyframes[k], refined[s][k], true, add);
    }
  }
  return count;
}

}  // namespace

TEST_CASE("refined labels and changes do not depend on where and how the map lies", "[frames]") {
  Random random(8);
  std::vector<Pose> poses[2];
  const Pose T_map_sensor = turned(7.0, -11.0, 40.0, {3.0, 2.0, 1.0});
  std::vector<SessionData> sessions;
  // Of the first session a person left, and a cabinet is gone in the second.
  const Sheet cabinet{8.1F, -3.6F, -2.0F, -1.4F, -0.2F};
  sessions.push_back(looking(random, 2, {kWall, kPerson, cabinet}, {}, poses[0], T_map_sensor));
  append(sessions[0], looking(random, 4, {kWall, cabinet}, {}, poses[0], T_map_sensor));
  sessions.push_back(looking(random, 5, {kWall}, {kCrate}, poses[1], T_map_sensor));
  for (KeyframeRecord& keyframe : sessions[1].keyframes) keyframe.scans[0].stamp_ns += 1000000;
  MergeConfig config;
  config.threads = 1;
  const auto run = [&](const Pose& turn) {
    std::vector<PosedSession> posed;
    std::vector<MergedSession> merged(2);
    std::vector<SessionVoxels> voxels;
    for (std::size_t s = 0; s < 2; ++s) {
      posed.push_back({&sessions[s], moved(turn, poses[s]), 0});
      merged[s].T_map_keyframe = posed[s].T_map_keyframe;
      merged[s].refined.resize(sessions[s].keyframes.size());
      voxels.push_back(voxelise(sessions[s], merged[s], config.map.voxel_size_m).fixed);
    }
    const auto changes = find_changes(sessions, merged, {&voxels[0], &voxels[1]}, config).points;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const ChangedPoint& change : changes) mean += change.position.cast<double>();
    mean /= static_cast<double>(std::max<std::size_t>(changes.size(), 1));
    struct {
      std::size_t dynamic, changes, map;
      Eigen::Vector3d mean;
    } const result{count_dynamic(posed, refine(posed, config.refinement, 1)), changes.size(),
                   unite({&voxels[0], &voxels[1]}).size(), turn.inverse() * mean};
    return result;
  };
  const auto before = run(Pose{});
  REQUIRE(before.dynamic > 50);
  REQUIRE(before.changes > 20);
  const auto close = [](std::size_t a, std::size_t b, double share) {
    return std::abs(static_cast<double>(a) - static_cast<double>(b)) <=
           share * static_cast<double>(b) + 1.0;
  };
  for (int quarter = 1; quarter < 4; ++quarter) {
    // On the same grid everything but single cells at the faces of voxels is as before.
    const auto after = run(grid_motion(quarter, {40.0, -60.0, 20.0}));
    CHECK(close(after.dynamic, before.dynamic, 0.02));
    CHECK(close(after.changes, before.changes, 0.1));
    CHECK(close(after.map, before.map, 0.02));
    CHECK((after.mean - before.mean).norm() < 0.1);
  }
  for (int round = 0; round < 3; ++round) {
    // On another grid the voxels are others.
    const auto after = run(any_pose(random, 50.0));
    CHECK(close(after.dynamic, before.dynamic, 0.1));
    CHECK(close(after.changes, before.changes, 0.35));
    CHECK((after.mean - before.mean).norm() < 0.25);
  }
}

TEST_CASE("keyframes are levelled alike in every odometry frame", "[frames]") {
  Random random(10);
  std::vector<KeyframeRecord> keyframes(4);
  const Pose lean = turned(6.0, -4.0, 0.0, Eigen::Vector3d::Zero());
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    KeyframeRecord& keyframe = keyframes[k];
    keyframe.T_odometry_keyframe =
        turned(0.0, 0.0, 25.0 * static_cast<double>(k), {5.0 * static_cast<double>(k), 1.0, 0.2});
    if (k >= 2) {
      keyframe.T_odometry_keyframe =
          level_frame(keyframe.T_odometry_keyframe, lean.rotation.col(2));
      keyframe.up = {true, 2e-5F, 5e-6F, 4e-5F};
    }
    keyframe.scans.push_back({0, 0, keyframe.T_odometry_keyframe});
    for (int i = 0; i < 40; ++i) {
      keyframe.static_cells.push_back({random.normal3(6.0).cast<float>(), 3, 0, 0});
    }
  }
  std::vector<KeyframeRecord> other = keyframes;
  const Pose turn = any_pose(random, 70.0);
  for (KeyframeRecord& keyframe : other) {
    keyframe.T_odometry_keyframe = turn * keyframe.T_odometry_keyframe;
  }
  const std::vector<KeyframeRecord> start = keyframes;
  REQUIRE(level_keyframes(keyframes) == 2);
  REQUIRE(level_keyframes(other) == 2);
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    INFO("keyframe " << k);
    check_same_pose(other[k].T_odometry_keyframe, turn * keyframes[k].T_odometry_keyframe, 1e-6,
                    1e-4);
    CHECK((keyframes[k].T_odometry_keyframe.rotation.col(2) - lean.rotation.col(2)).norm() < 1e-6);
    CHECK(other[k].up.variance_x == Approx(keyframes[k].up.variance_x));
    CHECK(other[k].up.covariance_xy == Approx(keyframes[k].up.covariance_xy).margin(1e-9));
    CHECK(other[k].up.variance_y == Approx(keyframes[k].up.variance_y));
    for (std::size_t i = 0; i < 40; i += 7) {
      // The frame has moved, the world has not.
      const Eigen::Vector3d a = start[k].T_odometry_keyframe *
                                Eigen::Vector3d(start[k].static_cells[i].position.cast<double>());
      const Eigen::Vector3d b =
          keyframes[k].T_odometry_keyframe *
          Eigen::Vector3d(keyframes[k].static_cells[i].position.cast<double>());
      CHECK((a - b).norm() < 1e-4);
    }
  }
}

TEST_CASE("a merge gives the same map whatever the sessions' odometry frames", "[frames]") {
  using namespace unimapper::merge::testing;
  const Town town = make_town(5, 1);
  // alpha covers more, so that it is the central session in every frame.
  std::vector<SessionData> sessions{
      record(town, drive_roads({{0, 0}, {1, 0}, {1, 0.4}}), "alpha", 1).session,
      record(town, drive_roads({{0, 0}, {0.7, 0}}), "beta", 2).session};
  MergeConfig config;
  config.threads = 1;
  const MergeResult before = merge_sessions(sessions, config);
  REQUIRE(is_in_map(before.sessions[1].status));
  REQUIRE(is_in_map(before.sessions[0].status));
  regression::Random random(11);
  std::vector<Pose> frames;
  for (SessionData& session : sessions) {
    frames.push_back(yaw_only(random, 200.0));
    for (KeyframeRecord& keyframe : session.keyframes) {
      keyframe.T_odometry_keyframe = frames.back() * keyframe.T_odometry_keyframe;
      for (KeyframeScan& scan : keyframe.scans) {
        scan.T_odometry_sensor = frames.back() * scan.T_odometry_sensor;
      }
    }
  }
  const MergeResult after = merge_sessions(sessions, config);
  REQUIRE(after.central_session == before.central_session);
  const Pose& central = frames[before.central_session];
  for (std::size_t s = 0; s < 2; ++s) {
    CHECK(after.sessions[s].status == before.sessions[s].status);
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      check_same_pose(after.sessions[s].T_map_keyframe[k],
                      central * before.sessions[s].T_map_keyframe[k], 0.02, 0.05);
    }
  }
  REQUIRE(after.loops.size() > 5);
  CHECK(std::abs(static_cast<double>(after.loops.size()) -
                 static_cast<double>(before.loops.size())) <=
        0.2 * static_cast<double>(before.loops.size()));
  for (const LoopConstraint& loop : after.loops) {
    for (const LoopConstraint& same : before.loops) {
      if (loop.query != same.query || loop.match != same.match) continue;
      if (!loop.decision.accepted || !same.decision.accepted) continue;
      check_same_pose(loop.T_match_query, same.T_match_query, 0.05, 0.3);
    }
  }
  // Where one map has a point, the other has one, too.
  std::vector<Eigen::Vector3f> old_points;
  std::vector<Eigen::Vector3f> new_points;
  for (const MapPoint& point : before.map) old_points.push_back(point.position);
  for (const MapPoint& point : after.map) new_points.push_back(point.position);
  old_points = moved(central, std::move(old_points));
  const auto share_near = [](const std::vector<Eigen::Vector3f>& points,
                             const std::vector<Eigen::Vector3f>& others) {
    const VoxelTrees trees(others, 2.0F);
    std::size_t near = 0;
    std::size_t all = 0;
    for (std::size_t i = 0; i < points.size(); i += 17, ++all) {
      near += trees.has_neighbor(points[i], 0.35F) ? 1 : 0;
    }
    return static_cast<double>(near) / static_cast<double>(all);
  };
  CHECK(share_near(old_points, new_points) > 0.98);
  CHECK(share_near(new_points, old_points) > 0.98);
  // The trajectory moves with the map, scan by scan.
  const auto a = session_trajectory(sessions[1], after.sessions[1]);
  for (std::size_t i = 0; i < a.size(); i += 5) {
    const std::size_t k = i / 3;
    check_same_pose(a[i].T_map_sensor, after.sessions[1].T_map_keyframe[k], 0.05, 0.1);
  }
}
