// Tests of the places of a merge's sessions at their newest keyframes.
#include "unimapper/merge/newest_map_poses.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "tests/merge/two_sessions.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

const OdometryNoiseConfig kNoise;

struct Site : testing::TwoSessions {
  [[nodiscard]] std::vector<MapPose> newest() const {
    return newest_map_poses(sessions, result, kNoise);
  }
};

double sigma_m(const MapPose& at) { return std::sqrt(at.covariance.topLeftCorner<3, 3>().trace()); }

}  // namespace

TEST_CASE("a session in the map is where its newest keyframe was merged", "[newest]") {
  Site site;
  site.loop({1, 2}, {0, 2}, 0.1, 0.01);
  const MapPose at = site.newest()[1];
  CHECK(at.state == LocalisationState::kLocalised);
  CHECK(at.reason.empty());
  CHECK(at.T_map_keyframe.translation == Eigen::Vector3d(50.0, 3.0, 0.0));
  CHECK((at.T_map_odometry.translation - Site::T_map_odometry(1).translation).norm() < 1e-9);
  CHECK(at.loops == 1);
  CHECK(at.path_m == Approx(50.0));
  CHECK(at.since_loop_m == Approx(30.0));
}

TEST_CASE("it is as sure as its latest loop and odometry since", "[newest]") {
  Site early;
  early.loop({1, 1}, {0, 1}, 0.1, 0.01);
  Site late = early;
  late.loop({1, 4}, {0, 4}, 0.1, 0.01);
  Site rejected = early;
  rejected.loop({1, 4}, {0, 4}, 0.1, 0.01).decision.accepted = false;
  CHECK(sigma_m(late.newest()[1]) < 0.8 * sigma_m(early.newest()[1]));
  CHECK(sigma_m(rejected.newest()[1]) == sigma_m(early.newest()[1]));
  CHECK(late.newest()[1].loops == 2);
}

TEST_CASE("the rotation of a loop moves what was found as it moves what was searched for",
          "[newest]") {
  // A hundred metres apart, known to a millimetre and to 0.01 rad.
  Site as_query;
  Site as_match;
  for (Site* site : {&as_query, &as_match}) {
    site->result.sessions[1].T_map_keyframe[5].translation.x() += 100.0;
    site->sessions[1].keyframes[5].T_odometry_keyframe.translation.x() += 100.0;
  }
  as_query.loop({1, 5}, {0, 5}, 1e-3, 0.01);
  as_match.loop({0, 5}, {1, 5}, 1e-3, 0.01);
  CHECK(sigma_m(as_query.newest()[1]) < 0.01);
  // By two of the three axes.
  CHECK(sigma_m(as_match.newest()[1]) == Approx(std::sqrt(2.0)).epsilon(0.01));
}

TEST_CASE("it is less sure where its odometry drifts farther than assumed", "[newest]") {
  Site site;
  site.loop({1, 2}, {0, 2}, 1e-3, 1e-5);
  Site drifting = site;
  drifting.result.sessions[1].drift_scale = 3.0;
  CHECK(sigma_m(drifting.newest()[1]) == Approx(3.0 * sigma_m(site.newest()[1])).epsilon(0.01));
}

TEST_CASE("the central session is where its odometry says, or a loop where that is surer",
          "[newest]") {
  Site alone;
  const MapPose at = alone.newest()[0];
  CHECK(at.state == LocalisationState::kLocalised);
  CHECK(at.loops == 0);
  CHECK(at.since_loop_m == Approx(50.0));
  Site unsure;
  unsure.loop({0, 5}, {0, 0}, 30.0, 1.0);
  CHECK(sigma_m(unsure.newest()[0]) == sigma_m(at));
  // The earlier keyframe was searched for: the later one is supported all the same.
  Site sure;
  sure.loop({0, 0}, {0, 5}, 1e-3, 1e-5);
  CHECK(sigma_m(sure.newest()[0]) < 0.5 * sigma_m(at));
}

TEST_CASE("a session outside of the map has no place, and says why", "[newest]") {
  Site site;
  site.result.sessions[1].status = SessionStatus::kProvisional;
  site.result.sessions[1].reason = "the place repeats";
  CHECK(site.newest()[1].state == LocalisationState::kAmbiguous);
  CHECK(site.newest()[1].reason == "the place repeats");
  site.result.sessions[1].status = SessionStatus::kUnconnected;
  CHECK(site.newest()[1].state == LocalisationState::kNotYet);
  site.result.sessions[1].T_map_keyframe.pop_back();
  CHECK_THROWS_AS(site.newest(), std::invalid_argument);
}
