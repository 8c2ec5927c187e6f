// Odometry: its drift, several keyframes as one measurement, steps as no robot moves
#include "src/core/cholesky.hpp"
#include "src/merge/graph/odometry_chain.hpp"
#include "src/merge/sessions/odometry_step.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "tests/merge/alignment_scene.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Catch::Matchers::Contains;

namespace {

std::vector<Pose> bent_path(std::size_t count) {
  std::vector<Pose> poses(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double turn = 0.15 * static_cast<double>(i);
    poses[i].translation = {40.0 * std::sin(turn), 30.0 * (1.0 - std::cos(turn)), 0.1 * turn};
  }
  return poses;
}

/// Every segment adds translation noise, and rotation noise that acts over the lever from its
/// middle to the far end.
RelativeVariance summed(const std::vector<Pose>& poses, std::size_t i, std::size_t j,
                        const OdometryNoiseConfig& noise) {
  constexpr double kTranslationFloor_m = 0.02;
  constexpr double kRotationFloor_rad = 0.001;
  RelativeVariance sum{kTranslationFloor_m * kTranslationFloor_m,
                       kRotationFloor_rad * kRotationFloor_rad};
  const double t = noise.translation_m_per_sqrt_m * noise.translation_m_per_sqrt_m;
  const double r = noise.rotation_rad_per_sqrt_m * noise.rotation_rad_per_sqrt_m;
  for (std::size_t k = std::min(i, j) + 1; k <= std::max(i, j); ++k) {
    const Eigen::Vector3d& from = poses[k - 1].translation;
    const Eigen::Vector3d& to = poses[k].translation;
    const double length = (to - from).norm();
    const double lever = (poses[j].translation - 0.5 * (from + to)).squaredNorm();
    sum.translation += t * length + r * length * lever;
    sum.rotation += r * length;
  }
  return sum;
}

}  // namespace

TEST_CASE("The variance of odometry between two keyframes is the sum over the way", "[path]") {
  const std::vector<Pose> poses = bent_path(30);
  const OdometryNoiseConfig noise;
  const SessionPath path(poses, noise);
  for (const auto& [i, j] :
       {std::pair<std::size_t, std::size_t>{0, 29}, {29, 0}, {7, 8}, {20, 3}}) {
    INFO(i << " to " << j);
    const RelativeVariance expected = summed(poses, i, j, noise);
    CHECK(path.variance(i, j).translation == Approx(expected.translation));
    CHECK(path.variance(i, j).rotation == Approx(expected.rotation));
    const Matrix6d information = path.information(i, j);
    CHECK(information(1, 1) == Approx(1.0 / expected.translation));
    CHECK(information(4, 4) == Approx(1.0 / expected.rotation));
  }
  CHECK(path.variance(5, 5).translation == 0.0);
}

TEST_CASE("Corrected poses change the levers but not the way travelled", "[path]") {
  const std::vector<Pose> poses = bent_path(30);
  std::vector<Pose> corrected = poses;
  for (Pose& pose : corrected) pose.translation *= 1.1;
  const SessionPath path(poses, OdometryNoiseConfig{});
  const SessionPath moved = path.with_poses(corrected);
  CHECK(moved.length_m() == path.length_m());
  CHECK(moved.path_m(11) == path.path_m(11));
  CHECK(moved[11].translation == corrected[11].translation);
  CHECK(moved.variance(0, 29).rotation == path.variance(0, 29).rotation);
  CHECK(moved.variance(0, 29).translation > path.variance(0, 29).translation);
}

TEST_CASE("The path of a session is the sum of its steps", "[path]") {
  SessionData session;
  CHECK(path_lengths_m(session).empty());
  session.keyframes.resize(4);
  session.keyframes[1].T_odometry_keyframe.translation = {3.0, 4.0, 0.0};
  session.keyframes[2].T_odometry_keyframe.translation = {3.0, 4.0, 12.0};
  session.keyframes[3].T_odometry_keyframe.translation = {0.0, 0.0, 0.0};
  CHECK(path_lengths_m(session) == std::vector<double>{0.0, 5.0, 17.0, 30.0});
  std::vector<Pose> poses;
  for (const auto& keyframe : session.keyframes) poses.push_back(keyframe.T_odometry_keyframe);
  const SessionPath path(poses, OdometryNoiseConfig{});
  CHECK(path.size() == 4);
  CHECK(path.path_m(2) == 17.0);
  CHECK(path.length_m() == 30.0);
  CHECK(SessionPath().length_m() == 0.0);
}

namespace {

SessionPath winding_path(Random& random, std::size_t count, bool slips = false) {
  std::vector<Pose> poses = odometry(random, drive(random, count, Pose{}));
  for (std::size_t i = 0; i < count; ++i) {
    poses[i] = poses[i] * shifted(0.0, 0.0, 0.3 * static_cast<double>(i % 5));
  }
  std::vector<SlipCovariance> slip(count, SlipCovariance::Zero());
  if (slips) slip[count / 3] = Eigen::Vector3f(0.3F, 0.4F, 0.0F).asDiagonal();
  return {poses, OdometryNoiseConfig{}, slip};
}

/// All keyframes of a path, both ends fixed.
PoseGraph whole_graph(const SessionPath& path, const std::vector<Pose>& poses) {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  for (std::size_t k = 0; k < path.size(); ++k) {
    graph.nodes.push_back({poses[k], 0, k == 0 || k + 1 == path.size()});
    if (k == 0) continue;
    graph.edges.push_back(
        {k - 1, k, path[k - 1].inverse() * path[k], path.information(k - 1, k), 0.0});
  }
  return graph;
}

}  // namespace

TEST_CASE("A chain of odometry costs as much as its keyframes solved between both ends",
          "[pose_graph]") {
  Random random(21);
  constexpr std::size_t kCount = 50;
  for (int trial = 0; trial < 5; ++trial) {
    const SessionPath path = winding_path(random, kCount, trial % 2 == 1);
    std::vector<Pose> poses = path.poses();
    poses.back() = poses.back() * random.pose(0.3, 0.01);
    PoseGraph whole = whole_graph(path, poses);
    REQUIRE(optimize(whole, 50).usable);

    PoseGraph chain;
    chain.anchors.push_back({Pose{}, true});
    chain.nodes.push_back({poses.front(), 0, true});
    chain.nodes.push_back({poses.back(), 0, true});
    chain.edges.push_back(
        {0, 1, path[0].inverse() * path[kCount - 1], chain_information(path, 0, kCount - 1), 0.0});
    CHECK(graph_cost(chain) == Approx(graph_cost(whole)).epsilon(0.02));

    interpolate_chain(path, 0, kCount - 1, poses);
    for (std::size_t k = 0; k < kCount; ++k) {
      const Pose apart = poses[k].inverse() * whole.nodes[k].T_session_node;
      CHECK(apart.translation.norm() < 0.01);
      CHECK(rotation_angle(apart.rotation) < 1e-4);
    }
  }
}

TEST_CASE("A slip that is a covariance but for rounding leaves edges that can be solved",
          "[path]") {
  SlipCovariance slip = Eigen::Vector3f(1e6F, -90.0F, 0.0F).asDiagonal();
  if (GENERATE(true, false)) {
    slip.setZero();
    const Eigen::Vector3f axis(0.48F, 0.6F, 0.64F);
    for (int scan = 0; scan < 10; ++scan) slip += 4.9e4F * axis * axis.transpose();
  }
  REQUIRE(is_slip(slip));
  const SessionPath path({Pose{}, {Pose{}.rotation, {1.0, 0.0, 0.3}}}, OdometryNoiseConfig{},
                         {SlipCovariance::Zero(), slip});
  CHECK(Cholesky<6>(path.information(0, 1)).valid());
  CHECK(Cholesky<3>(path.translation_covariance(0, 1)).valid());
}

TEST_CASE("A slip widens the covariance of its step, along its axis alone", "[path]") {
  const std::vector<Pose> poses{Pose{}, yaw_pose(0.5, {2.0, 0.0, 0.0}), shifted(4.0)};
  const Eigen::Vector3f way_m(0.0F, 3.0F, 0.0F);  // in the frame of the session
  const std::vector<SlipCovariance> slips{SlipCovariance::Zero(), SlipCovariance::Zero(),
                                          way_m * way_m.transpose()};
  const SessionPath path(poses, OdometryNoiseConfig{}, slips);
  const SessionPath sure(poses, OdometryNoiseConfig{});
  CHECK(path.information(0, 1) == sure.information(0, 1));
  CHECK(path.variance(1, 2).translation == Approx(sure.variance(1, 2).translation + 9.0));
  // Seen from the keyframe, which has turned.
  const Eigen::Vector3d along = poses[1].rotation.transpose() * Eigen::Vector3d::UnitY();
  const Eigen::Vector3d across = poses[1].rotation.transpose() * Eigen::Vector3d::UnitX();
  const Eigen::Matrix3d information = path.information(1, 2).topLeftCorner<3, 3>();
  CHECK(along.dot(information * along) == Approx(1.0 / path.variance(1, 2).translation));
  CHECK(across.dot(information * across) == Approx(sure.information(1, 2)(0, 0)));
}

TEST_CASE("A chain between neighbours is their odometry edge", "[pose_graph]") {
  Random random(22);
  const SessionPath path = winding_path(random, 10);
  CHECK(chain_information(path, 3, 4) == path.information(3, 4));
}

TEST_CASE("Keyframes between ends that odometry agrees with follow odometry", "[pose_graph]") {
  Random random(23);
  const SessionPath path = winding_path(random, 30);
  // Moved as a whole, which odometry says nothing about.
  const Pose moved = yaw_pose(1.1, {30.0, -50.0, 2.0});
  std::vector<Pose> poses(path.size());
  poses[5] = moved * path[5];
  poses[25] = moved * path[25];
  interpolate_chain(path, 5, 25, poses);
  for (std::size_t k = 5; k <= 25; ++k) {
    CHECK(apart_m(poses[k], moved * path[k]) < 1e-9);
  }
}

namespace {

constexpr std::int64_t kScanNs = 100'000'000;
constexpr std::uint32_t kScans = 10;

/// A robot that drives at `speed_mps`, in keyframes of ten scans.
SessionData driven(double speed_mps) {
  SessionData session;
  session.info.name = "driven";
  for (std::uint32_t k = 0; k < 6; ++k) {
    KeyframeRecord& keyframe = session.keyframes.emplace_back();
    keyframe.sequence = k;
    for (std::uint32_t scan = k * kScans; scan < (k + 1) * kScans; ++scan) {
      keyframe.scans.push_back({scan, scan * kScanNs, shifted(0.1 * speed_mps * scan)});
    }
    keyframe.T_odometry_keyframe = keyframe.scans[0].T_odometry_sensor;
  }
  return session;
}

void move(SessionData& session, std::size_t from, double by_m, std::int64_t later_ns = 0) {
  for (std::size_t k = from; k < session.keyframes.size(); ++k) {
    KeyframeRecord& keyframe = session.keyframes[k];
    keyframe.T_odometry_keyframe.translation.y() += by_m;
    for (KeyframeScan& scan : keyframe.scans) {
      scan.T_odometry_sensor.translation.y() += by_m;
      scan.stamp_ns += later_ns;
    }
  }
}

/// Two scans to each keyframe of a recorded drive, so that they tell a speed.
SessionData with_scans(SessionData session) {
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    KeyframeRecord& keyframe = session.keyframes[k];
    const auto stamp_ns = static_cast<std::int64_t>(k + 1) * 1'000'000'000;
    const auto scan = static_cast<std::uint32_t>(2 * k);
    keyframe.scans = {{scan, stamp_ns, keyframe.T_odometry_keyframe},
                      {scan + 1, stamp_ns + kScanNs, keyframe.T_odometry_keyframe}};
    keyframe.scans[1].T_odometry_sensor.translation.x() += 0.1;
    keyframe.reference_scan = 0;
  }
  return session;
}

}  // namespace

TEST_CASE("A step is impossible beyond 3 m and half again the way at the fastest speed") {
  const double speed_mps = GENERATE(0.01, 1.0, 12.0);
  INFO(speed_mps << " m/s");
  const double way_m = 0.1 * 1.5 * std::max(speed_mps, 3.0);
  const double along_m = 0.1 * speed_mps;
  SessionData session = driven(speed_mps);
  CHECK_FALSE(find_impossible_step(session));
  const double across_m = std::sqrt(std::pow(3.0 + way_m, 2) - along_m * along_m);
  SessionData below = session;
  move(below, 4, across_m - 0.01);
  CHECK_FALSE(find_impossible_step(below));
  move(session, 4, across_m + 0.01);
  const auto step = find_impossible_step(session);
  REQUIRE(step);
  CHECK(step->keyframe == 4);
  CHECK(step->length_m == Approx(3.0 + way_m).margin(0.02));
  CHECK(step->duration_s == Approx(0.1));
  CHECK_THAT(reason_against_odometry(session), Contains("before keyframe 4"));
}

TEST_CASE("Keyframes that were lost are no step: the robot went on meanwhile") {
  SessionData session = driven(1.5);
  move(session, 3, 80.0, 20 * 1'000'000'000LL);
  CHECK_FALSE(find_impossible_step(session));
}

TEST_CASE(
    "Nothing is concluded from keyframes of one scan or pose, or stamps that do not increase") {
  SessionData session = driven(1.0);
  move(session, 3, 80.0);
  REQUIRE(find_impossible_step(session));
  SessionData single = session;
  for (KeyframeRecord& keyframe : single.keyframes) keyframe.scans.resize(1);
  CHECK_FALSE(find_impossible_step(single));
  SessionData held = session;
  for (KeyframeRecord& keyframe : held.keyframes) {
    for (KeyframeScan& scan : keyframe.scans) scan.T_odometry_sensor = keyframe.T_odometry_keyframe;
  }
  CHECK_FALSE(find_impossible_step(held));
  for (KeyframeRecord& keyframe : session.keyframes) {
    for (KeyframeScan& scan : keyframe.scans) scan.stamp_ns = 7;
  }
  CHECK_FALSE(find_impossible_step(session));
  CHECK_FALSE(find_impossible_step({}));
}

TEST_CASE("A session whose odometry started anew is no part of the map, and says why", "[merger]") {
  const auto town = make_town(5, 1);
  const auto first = with_scans(record(town, drive_roads({{0, 0}, {1, 0}}), "first", 3).session);
  const auto right = with_scans(record(town, drive_roads({{1, 0}, {0, 0}}), "second", 4).session);
  SessionData wrong = right;
  move(wrong, wrong.keyframes.size() / 2, 40.0);
  const MergeResult together = merge_sessions({first, right}, MergeConfig{});
  REQUIRE(is_in_map(together.sessions[1].status));
  CHECK(together.sessions[1].reason.empty());
  const MergeResult apart = merge_sessions({first, wrong}, MergeConfig{});
  CHECK(apart.sessions[0].status == SessionStatus::kCentral);
  CHECK(apart.sessions[0].reason.empty());
  CHECK(apart.sessions[1].status == SessionStatus::kUnconnected);
  CHECK_THAT(apart.sessions[1].reason, Contains("its odometry steps by"));
  // Alone it is mapped, with that word.
  const MergeResult alone = merge_sessions({wrong}, MergeConfig{});
  CHECK(alone.sessions[0].status == SessionStatus::kCentral);
  CHECK_THAT(alone.sessions[0].reason, Contains("a new session must begin"));
}
