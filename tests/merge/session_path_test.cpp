// Tests of the drift model of odometry, against its sum segment by segment
#include "src/merge/session_path.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <utility>

using namespace unimapper;
using namespace unimapper::merge;

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
