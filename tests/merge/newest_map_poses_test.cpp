// Poses of a merged map: how sure they are, and those of the newest keyframes
#include "src/merge/localisation/newest_map_poses.hpp"

#include "src/merge/graph/gauss_newton.hpp"
#include "src/merge/graph/position_sigma.hpp"
#include "tests/merge/poses.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// A merged map with exact poses: two sessions of six keyframes, ten metres apart along x; the
/// second drives three metres beside the first, and its odometry begins somewhere else.
struct TwoSessions {
  std::vector<SessionData> sessions{2};
  MergeResult result;

  TwoSessions() {
    for (std::size_t s = 0; s < 2; ++s) {
      MergedSession& merged = result.sessions.emplace_back();
      merged.status = s == 0 ? SessionStatus::kCentral : SessionStatus::kMerged;
      for (int k = 0; k < 6; ++k) {
        const Pose T_map_keyframe = shifted(10.0 * k, 3.0 * static_cast<double>(s));
        merged.T_map_keyframe.push_back(T_map_keyframe);
        sessions[s].keyframes.emplace_back().T_odometry_keyframe =
            T_map_odometry(s).inverse() * T_map_keyframe;
      }
    }
  }
  static Pose T_map_odometry(std::size_t session) {
    return session == 0 ? Pose() : shifted(100.0, -40.0, 2.0);
  }
  /// An accepted loop that fits, with these deviations in metres and radians.
  LoopConstraint& loop(KeyframeId query, KeyframeId match, double sigma_m, double sigma_rad) {
    LoopConstraint& loop = result.loops.emplace_back();
    loop.query = query;
    loop.match = match;
    loop.T_match_query = result.sessions[match.session].T_map_keyframe[match.keyframe].inverse() *
                         result.sessions[query.session].T_map_keyframe[query.keyframe];
    loop.information.setZero();
    loop.information.diagonal() << 1.0, 1.0, 1.0, 0.0, 0.0, 0.0;
    loop.information *= 1.0 / (sigma_m * sigma_m);
    loop.information.bottomRightCorner<3, 3>().diagonal().setConstant(1.0 /
                                                                      (sigma_rad * sigma_rad));
    loop.decision.accepted = true;
    return loop;
  }
};

std::vector<std::vector<double>> sigmas_of(const TwoSessions& site) {
  return position_sigmas_m(site.sessions, site.result, OdometryNoiseConfig{});
}

/// The second session is no part of the map.
TwoSessions one_session() {
  TwoSessions site;
  site.result.sessions[1].status = SessionStatus::kUnconnected;
  return site;
}

}  // namespace

TEST_CASE("without loops both ends of a drive are known least, relative to the whole of it") {
  const auto sigmas = sigmas_of(one_session());
  REQUIRE(sigmas[0].size() == 6);
  CHECK(std::min_element(sigmas[0].begin(), sigmas[0].end()) - sigmas[0].begin() ==
        Approx(2.5).margin(1));
  CHECK(*std::max_element(sigmas[0].begin(), sigmas[0].end()) == Approx(sigmas[0][0]).epsilon(0.2));
  CHECK(sigmas[0][5] == Approx(sigmas[0][0]).epsilon(0.2));
  CHECK(sigmas[1].empty());
}

TEST_CASE("deviations are the same whichever keyframe begins the graph") {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  std::vector<std::size_t> frame;
  for (std::size_t i = 0; i < 8; ++i) {
    frame.push_back(i);
    graph.nodes.push_back(
        {shifted(3.0 * static_cast<double>(i), i % 3 == 0 ? 4.0 : 0.0), 0, false});
    if (i == 0) continue;
    const Pose step = graph.T_map_node(i - 1).inverse() * graph.T_map_node(i);
    graph.edges.push_back({i - 1, i, step, 100.0 * Matrix6d::Identity(), 0.0});
  }
  const auto fixed_at = [&](std::size_t node) {
    PoseGraph fixed = graph;
    fixed.nodes[node].fixed = true;
    return position_covariances(fixed, frame);
  };
  const auto first = fixed_at(0);
  const auto fifth = fixed_at(5);
  REQUIRE(first.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) CHECK((first[i] - fifth[i]).norm() < 1e-9);
  CHECK(first[0].trace() > 0.001);
  graph.edges.clear();
  CHECK(fixed_at(0).size() == 8);
}

TEST_CASE("the stretch with the least sure position is told, with its numbers and its path") {
  SessionData session = TwoSessions().sessions[0];
  for (std::size_t k = 0; k < 6; ++k) {
    session.keyframes[k].sequence = static_cast<std::uint32_t>(k + 10);
  }
  CHECK(unsure_text(session, {0.4, 0.1, 0.31, 0.52, 0.31, 0.1}) ==
        "positions are sure to 0.5 m only in keyframes 12 to 14, 20 m of path, which too few loops "
        "hold; drive there again, or state a link");
  CHECK(unsure_text(session, std::vector<double>(6, 0.7)).find("10 to 15, 50 m") !=
        std::string::npos);
  CHECK(unsure_text(session, std::vector<double>(6, 0.25)).empty());
  CHECK(unsure_text(session, {}).empty());
  // A single keyframe is none, unless it is all there is; the longer stretch is told.
  CHECK(unsure_text(session, {0.9, 0.1, 0.1, 0.1, 0.3, 0.4}).find("14 to 15, 10 m") !=
        std::string::npos);
  CHECK(unsure_text(session, {0.9, 0.1, 0.1, 0.1, 0.1, 0.1}).empty());
  session.keyframes.resize(1);
  CHECK_FALSE(unsure_text(session, {0.9}).empty());
}

TEST_CASE("a loop back to the start makes both ends surer") {
  TwoSessions site = one_session();
  const auto open = sigmas_of(site);
  site.loop({0, 5}, {0, 0}, 0.01, 0.001);
  const auto closed = sigmas_of(site);
  CHECK(closed[0][0] < 0.7 * open[0][0]);
  CHECK(closed[0][5] < 0.7 * open[0][5]);
}

TEST_CASE("another session is as sure as the loop that ties it, and what that is tied to") {
  TwoSessions site;
  site.loop({1, 0}, {0, 3}, 0.5, 0.02);
  const auto sigmas = sigmas_of(site);
  const auto alone = sigmas_of(one_session());
  CHECK(sigmas[0][5] == Approx(alone[0][5]));
  CHECK(sigmas[1][0] > std::hypot(alone[0][3], 0.49));
  CHECK(sigmas[1][5] > sigmas[1][0]);
}

TEST_CASE("the loops of a session that is not in the map are no part of it") {
  TwoSessions last = one_session();
  const auto alone = sigmas_of(last);
  last.loop({1, 5}, {1, 0}, 0.01, 0.001);
  CHECK(sigmas_of(last) == alone);

  TwoSessions first;
  first.result.sessions[0].status = SessionStatus::kUnconnected;
  first.result.sessions[1].status = SessionStatus::kCentral;
  const auto without = sigmas_of(first);
  first.loop({0, 5}, {0, 0}, 0.01, 0.001);
  CHECK(sigmas_of(first) == without);
}

TEST_CASE("a session in the map that nothing ties has no deviation, nor has any other") {
  const auto sigmas = sigmas_of(TwoSessions());
  CHECK(sigmas[0].empty());
  CHECK(sigmas[1].empty());
}

namespace {

const OdometryNoiseConfig kNoise;

struct Site : TwoSessions {
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
