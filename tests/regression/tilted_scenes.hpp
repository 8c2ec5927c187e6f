// Tilted and turned input for the stages of a merge
#pragma once

#include "fleet.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "tests/merge/synthetic_sheets.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::regression {

using namespace unimapper::merge;

/// Turned by at most the given angles and moved by at most `extent` along each axis.
inline Pose turned_within(Random& random, double tilt_deg, double yaw_deg,
                          const Eigen::Vector3d& extent) {
  // One by one: compilers evaluate arguments in different orders.
  const double roll = random.uniform(-tilt_deg, tilt_deg);
  const double pitch = random.uniform(-tilt_deg, tilt_deg);
  const double yaw = random.uniform(-yaw_deg, yaw_deg);
  Eigen::Vector3d at;
  for (int axis = 0; axis < 3; ++axis) at(axis) = random.uniform(-extent(axis), extent(axis));
  return turned(roll, pitch, yaw, at);
}

inline Pose any_pose(Random& random, double extent_m) {
  return turned_within(random, 40.0, 175.0, Eigen::Vector3d::Constant(extent_m));
}

/// A positive definite matrix with correlations between all axes, of about the given deviations.
inline Matrix6d any_information(Random& random, double sigma_m, double sigma_rad) {
  Matrix6d root = Matrix6d::Identity();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < row; ++column) root(row, column) = random.uniform(-0.6, 0.6);
    root.row(row) /= root.row(row).norm();
  }
  Matrix6d covariance = root * root.transpose();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      covariance(row, column) *=
          (row < 3 ? sigma_m : sigma_rad) * (column < 3 ? sigma_m : sigma_rad);
    }
  }
  const Matrix6d information = covariance.inverse();
  return 0.5 * (information + information.transpose());
}

/// A way that bends, climbs and tilts, in a frame that is turned in all directions.
inline std::vector<Pose> winding_way(Random& random, std::size_t count, double step_m) {
  Pose pose = any_pose(random, 50.0);
  std::vector<Pose> way;
  for (std::size_t i = 0; i < count; ++i) {
    way.push_back(pose);
    const double length = step_m * random.uniform(0.6, 1.4);
    pose = pose * turned(0.0, 0.0, 2.0, {length, 0.0, 0.0}) *
           turned_within(random, 2.5, 14.0, {0.0, 0.3, 0.2});
  }
  return way;
}

inline std::vector<Pose> with_drift(const std::vector<Pose>& truth, Random& random, double sigma_m,
                                    double sigma_rad) {
  std::vector<Pose> odometry{any_pose(random, 80.0)};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    odometry.push_back(odometry.back() * truth[i - 1].inverse() * truth[i] *
                       random.pose(sigma_m, sigma_rad));
  }
  return odometry;
}

inline OdometryNoiseConfig some_noise() {
  OdometryNoiseConfig noise;
  noise.translation_m_per_sqrt_m = 0.025;
  noise.rotation_rad_per_sqrt_m = 0.0015;
  return noise;
}

/// Three sessions of one way: the whole of it, a part the other way round, another part.
struct Sessions {
  std::vector<std::vector<Pose>> truth;
  std::vector<AlignmentSession> sessions;
  std::vector<LoopConstraint> loops;
};

inline Sessions three_sessions(std::uint64_t seed) {
  Random random(seed);
  Sessions s;
  const std::vector<Pose> way = winding_way(random, 70, 4.0);
  std::vector<Pose> back(way.begin() + 10, way.begin() + 50);
  std::reverse(back.begin(), back.end());
  for (Pose& pose : back) pose = pose * turned(3.0, -2.0, 178.0, {0.5, 1.0, -0.4});
  std::vector<Pose> part(way.begin() + 30, way.begin() + 66);
  for (Pose& pose : part) pose = pose * turned(-4.0, 5.0, 25.0, {1.0, -0.7, 0.3});
  s.truth = {way, back, part};
  const double scores[] = {0.4, 0.9, 0.5};
  const double extents[] = {35.0, 18.0, 30.0};
  for (std::size_t i = 0; i < 3; ++i) {
    s.sessions.push_back({with_drift(s.truth[i], random, 0.03, 0.001), scores[i], extents[i]});
  }
  const auto add = [&](KeyframeId query, KeyframeId match, bool wrong) {
    LoopConstraint loop;
    loop.query = query;
    loop.match = match;
    const Pose truth =
        s.truth[match.session][match.keyframe].inverse() * s.truth[query.session][query.keyframe];
    loop.T_match_query = truth * random.pose(0.1, 0.01);
    if (wrong) loop.T_match_query = loop.T_match_query * turned(2.0, 5.0, 40.0, {4.0, -3.0, 1.0});
    loop.information = any_information(random, 0.15, 0.012);
    loop.overlap = random.uniform(0.45, 0.95);
    loop.confidence = static_cast<float>(random.uniform(0.5, 1.0));
    s.loops.push_back(loop);
  };
  // Session 1 has way 49 - k at k, session 2 has way 30 + k at k; in both directions.
  for (std::size_t k = 1; k < 40; k += 4) add({1, k}, {0, 49 - k}, k == 13);
  for (std::size_t k = 2; k < 36; k += 5) add({0, 30 + k}, {2, k}, k == 17);
  for (std::size_t k = 3; k < 20; k += 4) add({2, k}, {1, 19 - k}, false);
  add({0, 60}, {0, 20}, true);
  add({0, 45}, {0, 12}, false);
  return s;
}

/// What a keyframe of a corner of walls with posts holds, in the keyframe's frame.
struct Corner {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint8_t> ground;
};

inline Corner corner(Random& random, const Pose& T_keyframe_world, double noise_m) {
  Corner c;
  const auto add = [&](double x, double y, double z, bool is_ground) {
    const Eigen::Vector3d p = T_keyframe_world * Eigen::Vector3d(x, y, z);
    c.points.push_back((p + random.normal3(noise_m)).cast<float>());
    c.ground.push_back(static_cast<std::uint8_t>(is_ground ? 1 : 0));
  };
  for (int i = 0; i < 1500; ++i) {
    const double u = random.uniform();
    const double v = random.uniform();
    add(-14.0 + 28.0 * u, 9.0, 5.0 * v, false);
    add(12.0, -10.0 + 19.0 * v, 4.0 * u, false);
    add(-14.0 + 26.0 * v, -10.0 + 19.0 * u, 0.0, true);
  }
  for (int post = 0; post < 5; ++post) {
    const double x = -10.0 + 4.5 * post;
    for (int i = 0; i < 60; ++i) {
      const double u = random.uniform(-0.1, 0.1);
      const double v = random.uniform(-0.1, 0.1);
      add(x + u, -3.0 - post + v, random.uniform(0.0, 3.5), false);
    }
  }
  return c;
}

using merge::testing::keyframe_of;
using merge::testing::kPerson;
using merge::testing::kWall;
using merge::testing::Sheet;

/// Keyframes that all look at the same sheets, from poses that are tilted and apart: cells are
/// given in the keyframe's frame, the images are those of a sensor turned against it.
inline SessionData looking(Random& random, std::size_t count_of, const std::vector<Sheet>& kept,
                           const std::vector<Sheet>& removed, std::vector<Pose>& T_map_keyframe,
                           const Pose& T_map_sensor0) {
  SessionData session;
  for (std::size_t k = 0; k < count_of; ++k) {
    KeyframeRecord keyframe = keyframe_of(static_cast<std::uint32_t>(k), kept, removed);
    const Pose T_keyframe_sensor = turned_within(random, 9.0, 170.0, {0.3, 0.3, 0.2});
    const Pose T_odometry_keyframe = any_pose(random, 100.0);
    for (auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
      for (FineCell& cell : *cells) {
        cell.position =
            (T_keyframe_sensor * Eigen::Vector3d(cell.position.cast<double>())).cast<float>();
      }
    }
    keyframe.T_odometry_keyframe = T_odometry_keyframe;
    keyframe.scans[0] = {0, static_cast<std::int64_t>(k) * 1000,
                         T_odometry_keyframe * T_keyframe_sensor};
    keyframe.image_full_weight_range_m = 8.0F;
    session.keyframes.push_back(keyframe);
    T_map_keyframe.push_back(T_map_sensor0 * random.pose(0.005, 0.0005) *
                             T_keyframe_sensor.inverse());
  }
  return session;
}

/// More keyframes of the same session.
inline void append(SessionData& session, const SessionData& more) {
  for (KeyframeRecord keyframe : more.keyframes) {
    keyframe.sequence = static_cast<std::uint32_t>(session.keyframes.size());
    session.keyframes.push_back(std::move(keyframe));
  }
}

inline const Sheet kCrate{9.1F, 2.0F, 3.2F, -1.4F, -0.2F};

}  // namespace unimapper::regression
