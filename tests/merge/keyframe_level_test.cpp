// Keyframes and maps levelled by what is known of up
#include "unimapper/merge/keyframe_level.hpp"

#include "src/merge/graph/map_level.hpp"
#include "src/merge/loops/loop_search.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

constexpr KeyframeUp kSureUp{true, 1e-5F, 0.0F, 1e-5F};
constexpr KeyframeUp kUnsureUp{true, 1e-2F, 0.0F, 1e-2F};

}  // namespace

TEST_CASE("a map whose keyframes lean is turned upright") {
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.05, 1.0).normalized();
  const std::vector<UpObservation> observations(5, UpObservation{up, kSureUp});
  const Eigen::Matrix3d turn = levelling_rotation(observations);
  CHECK((turn * up - Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  // The shortest turn: none about the vertical.
  CHECK((turn * up.cross(Eigen::Vector3d::UnitZ()) - up.cross(Eigen::Vector3d::UnitZ())).norm() <
        1e-12);
}

TEST_CASE("a map of which nobody knows up stays as it is") {
  const std::vector<UpObservation> observations{{{0.1, 0.0, 0.99}, {}}};
  CHECK(levelling_rotation(observations) == Eigen::Matrix3d::Identity());
  CHECK(levelling_rotation({}) == Eigen::Matrix3d::Identity());
}

TEST_CASE("certain keyframes count more than uncertain ones") {
  const Eigen::Vector3d sure = Eigen::Vector3d(0.1, 0.0, 1.0).normalized();
  const Eigen::Vector3d unsure = Eigen::Vector3d(-0.1, 0.0, 1.0).normalized();
  const Eigen::Matrix3d turn =
      levelling_rotation(std::vector<UpObservation>{{sure, kSureUp}, {unsure, kUnsureUp}});
  CHECK((turn * sure).head<2>().norm() < 1e-3);
}

TEST_CASE("a direction is turned to z the shortest way, one that points down by half a turn") {
  const Eigen::Matrix3d quarter = rotation_to_z(Eigen::Vector3d(2.0, 0.0, 0.0));
  CHECK((quarter * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  CHECK((quarter * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitY()).norm() < 1e-12);
  for (const double lean : {0.0, 1e-9, 1e-7, 2e-6, 1e-3}) {
    const Eigen::Vector3d down(lean, 0.0, -1.0);
    const Eigen::Matrix3d half = rotation_to_z(down);
    CHECK((half * down.normalized() - Eigen::Vector3d::UnitZ()).norm() < 1e-6);
    CHECK((half * half.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6);
    CHECK(half.determinant() > 0.0);
  }
}

namespace {

constexpr float kSure = 1e-5F;  // (0.18 degrees)²
/// The odometry drifts by 0.05 degrees per keyframe.
const double kDrift = std::pow(0.05 / kDegreesPerRadian, 2);

/// A keyframe of a session on a tilted mount: z is the odometry's until up is known.
KeyframeRecord keyframe_at(double along_m, const Eigen::Vector3d& up, bool known) {
  const Pose sensor = shifted(along_m);
  KeyframeRecord keyframe;
  keyframe.T_odometry_keyframe = known ? level_frame(sensor, up) : sensor;
  if (known) keyframe.up = {true, kSure, 0.0F, 2.0F * kSure};
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(5.0, 1.0, 0.0), Eigen::Vector3d(0.0, -7.0, 3.0)}) {
    const Eigen::Vector3d own = keyframe.T_odometry_keyframe.inverse() * (sensor * p);
    keyframe.static_cells.push_back({own.cast<float>(), 3, 0, 0});
    keyframe.dynamic_cells.push_back({own.cast<float>(), 3, 0, 0});
  }
  return keyframe;
}

const Eigen::Vector3d kUp = Eigen::Vector3d(-0.17, 0.05, 1.0).normalized();

}  // namespace

TEST_CASE("a keyframe before up was known is levelled by one after it") {
  std::vector<KeyframeRecord> keyframes = {
      keyframe_at(0.0, kUp, false), keyframe_at(5.0, kUp, false), keyframe_at(10.0, kUp, true)};
  const std::vector<KeyframeRecord> before = keyframes;
  CHECK(level_keyframes(keyframes) == 2);
  for (std::size_t k = 0; k < 3; ++k) {
    const KeyframeRecord& keyframe = keyframes[k];
    CHECK((keyframe.T_odometry_keyframe.rotation.col(2) - kUp).norm() < 1e-9);
    CHECK(keyframe.T_odometry_keyframe.is_rigid(1e-9));
    CHECK(keyframe.T_odometry_keyframe.translation == before[k].T_odometry_keyframe.translation);
    for (std::size_t i = 0; i < keyframe.static_cells.size(); ++i) {
      // The cells stay where they are in the odometry frame.
      const auto in_odometry = [i](const KeyframeRecord& of) {
        const Eigen::Vector3d p = of.static_cells[i].position.cast<double>();
        return Eigen::Vector3d(of.T_odometry_keyframe * p);
      };
      CHECK((in_odometry(keyframe) - in_odometry(before[k])).norm() < 1e-5);
      CHECK(keyframe.dynamic_cells[i].position == keyframe.static_cells[i].position);
    }
  }
  REQUIRE(keyframes[0].up.known);
  CHECK(static_cast<double>(keyframes[0].up.variance_x) ==
        Approx(static_cast<double>(kSure) + 2.0 * kDrift).epsilon(1e-3));
  CHECK(static_cast<double>(keyframes[1].up.variance_y) ==
        Approx(2.0 * static_cast<double>(kSure) + kDrift).epsilon(1e-3));
  CHECK(keyframes[2].up == before[2].up);
}

TEST_CASE(
    "what is known of up keeps its direction in the frame of a keyframe with another heading") {
  std::vector<KeyframeRecord> keyframes = {keyframe_at(0.0, Eigen::Vector3d::UnitZ(), false),
                                           keyframe_at(5.0, Eigen::Vector3d::UnitZ(), true)};
  keyframes[0].T_odometry_keyframe.rotation = yaw_pose(0.5).rotation;
  keyframes[1].up = {true, 8.0F * kSure, 2.0F * kSure, kSure};
  REQUIRE(level_keyframes(keyframes) == 1);
  const auto variance_along = [](const KeyframeRecord& keyframe, const Eigen::Vector2d& direction) {
    const Eigen::Vector2d own =
        keyframe.T_odometry_keyframe.rotation.topLeftCorner<2, 2>().transpose() * direction;
    Eigen::Matrix2d covariance;
    covariance << keyframe.up.variance_x, keyframe.up.covariance_xy, keyframe.up.covariance_xy,
        keyframe.up.variance_y;
    return own.dot(covariance * own);
  };
  for (const double heading : {0.0, 0.8, 1.6, 2.4}) {
    const Eigen::Vector2d direction(std::cos(heading), std::sin(heading));
    CHECK(variance_along(keyframes[0], direction) ==
          Approx(variance_along(keyframes[1], direction) + kDrift).epsilon(1e-3));
  }
}

TEST_CASE("of several keyframes that know up the one that tells most counts") {
  const Eigen::Vector3d other = Eigen::Vector3d(0.1, 0.0, 1.0).normalized();
  std::vector<KeyframeRecord> keyframes = {
      keyframe_at(0.0, kUp, true), keyframe_at(5.0, kUp, false), keyframe_at(10.0, other, true)};
  keyframes[0].up.variance_x = 100.0F * kSure;
  CHECK(level_keyframes(keyframes) == 1);
  CHECK((keyframes[1].T_odometry_keyframe.rotation.col(2) - other).norm() < 1e-9);
}

TEST_CASE("nothing is levelled where no keyframe knows up, or beyond a jump of the odometry") {
  std::vector<KeyframeRecord> unknown = {keyframe_at(0.0, kUp, false),
                                         keyframe_at(5.0, kUp, false)};
  CHECK(level_keyframes(unknown) == 0);
  CHECK_FALSE(unknown[0].up.known);
  std::vector<KeyframeRecord> none;
  CHECK(level_keyframes(none) == 0);
  std::vector<KeyframeRecord> restarted = {keyframe_at(0.0, kUp, false),
                                           keyframe_at(500.0, kUp, true)};
  CHECK(level_keyframes(restarted) == 0);
  CHECK(restarted[0].T_odometry_keyframe.rotation == Eigen::Matrix3d::Identity());
}

TEST_CASE("levelled keyframes are found again") {
  const Town town = make_town(3, 3);
  const std::vector<Pose> route = drive_roads({{1, 0.4}, {1, 1}, {1.6, 1}});
  std::vector<SessionData> sessions = {record(town, route, "level", 1).session,
                                       record(town, route, "tilted", 2).session};
  std::vector<KeyframeRecord>& tilted = sessions[1].keyframes;
  const Pose tilt = turned_about({0.6, 0.8, 0.0}, 0.15);
  for (std::size_t k = 0; k < tilted.size(); ++k) {
    const Pose T_odometry_before = tilt * tilted[k].T_odometry_keyframe;
    const bool knows = k + 1 == tilted.size();
    if (knows) tilted[k].up = {true, kSure, 0.0F, kSure};
    tilted[k].T_odometry_keyframe =
        knows ? T_odometry_before : level_frame(T_odometry_before, Eigen::Vector3d::UnitZ());
    const Pose T_now_before = tilted[k].T_odometry_keyframe.inverse() * T_odometry_before;
    for (FineCell& cell : tilted[k].static_cells) {
      cell.position = (T_now_before * cell.position.cast<double>().eval()).cast<float>();
    }
    if (!knows) tilted[k].keypoints.clear();
    tilted[k].planes.clear();
  }
  CHECK(level_keyframes(tilted) == tilted.size() - 1);
  std::size_t accepted = 0;
  for (const LoopCandidate& loop : find_inter_session_candidates(sessions, {})) {
    // The two drives are the same: of a pair with equal numbers the truth is identity.
    if (loop.accepted && loop.query.keyframe == loop.match.keyframe) {
      accepted += loop.T_match_query.translation.norm() < 0.5 ? 1 : 0;
    }
  }
  CHECK(accepted * 10 > tilted.size() * 7);
}
