// Anchor-node pose graph: kernel, weak axes, loop ends, plausible deformation
#include "src/merge/graph/map_graph.hpp"

#include "src/merge/registration/weak_axis.hpp"
#include "tests/merge/alignment_scene.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

MapState straight_map(std::size_t count) {
  return make_map_state({SessionPath(straight(count), OdometryNoiseConfig{})});
}

}  // namespace

TEST_CASE("The Cauchy kernel costs scale^2 log(1 + chi2 / scale^2)", "[pose_graph]") {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  graph.nodes = {{Pose{}, 0, true}, {Pose{}, 0, false}};
  graph.edges.push_back({0, 1, shifted(3.0), Matrix6d::Identity(), 0.0});
  CHECK(edge_chi2(graph, graph.edges[0]) == Approx(9.0));
  CHECK(graph_cost(graph) == Approx(9.0));
  graph.edges[0].cauchy_scale = 2.0;
  CHECK(edge_chi2(graph, graph.edges[0]) == Approx(9.0));
  CHECK(graph_cost(graph) == Approx(4.0 * std::log(1.0 + 9.0 / 4.0)));
}

TEST_CASE("Along its free axis a loop is bounded by where a right candidate starts",
          "[pose_graph]") {
  const MapState state = straight_map(3);
  LoopConstraint loop;
  loop.match = {0, 0};
  loop.query = {0, 2};
  loop.information = weakened(1e4 * Matrix6d::Identity(), Eigen::Vector3d::UnitX());
  const auto chi2 = [&](double along_m, double across_m) {
    loop.T_match_query.translation = {10.0 + along_m, across_m, 0.0};
    return loop_chi2(state, loop);
  };
  CHECK(chi2(0.0, 0.0) < 1e-9);
  CHECK(chi2(0.9, 0.0) < 1.0);
  CHECK(chi2(25.0, 0.0) > 100.0);  // the next niche of a tunnel
  CHECK(chi2(0.0, 0.1) == Approx(100.0));
}

TEST_CASE("Many sessions solved at their loop ends lie where all of their keyframes put them",
          "[pose_graph]") {
  Random random(31);
  Scene scene;
  const std::vector<Pose> street = drive(random, 60, yaw_pose(0.8, {100.0, -400.0, 3.0}));
  std::vector<SessionPath> odometry_of;
  std::vector<std::size_t> sessions;
  for (std::size_t s = 0; s < kFewSessions + 2; ++s) {
    sessions.push_back(s);
    odometry_of.emplace_back(odometry(random, street), OdometryNoiseConfig{});
    for (std::size_t k = 5; s > 0 && k < 50; k += 9) {
      loop(scene, {s, k + s % 3}, {s - 1, k}, street[k].inverse() * street[k + s % 3], random);
    }
  }
  MapState start = make_map_state(odometry_of);
  start.central = 2;
  for (const std::size_t s : sessions) {
    start.T_map_session[s] = odometry_of[2][0] * odometry_of[s][0].inverse();
  }
  const auto solve = [&](Variables variables) {
    MapState state = start;
    REQUIRE(optimize_maps(state, sessions, scene.loops, GraphConfig{}, variables));
    CHECK(state.T_map_session[2].translation == start.T_map_session[2].translation);
    return state;
  };
  const MapState whole = solve(Variables::kAllKeyframes);
  const MapState ends = solve(Variables::kLoopEnds);
  double moved_m = 0.0;
  for (const std::size_t s : sessions) {
    CHECK(whole.T_session_keyframe[s][0].translation == odometry_of[s][0].translation);
    for (std::size_t k = 0; k < street.size(); ++k) {
      const Pose at = whole.T_map_keyframe({s, k});
      CHECK(apart_m(at, ends.T_map_keyframe({s, k})) < 0.05);
      moved_m = std::max(moved_m, apart_m(at, start.T_map_keyframe({s, k})));
    }
  }
  CHECK(moved_m > 1.0);
}

TEST_CASE("A map may bend as far as the configured floor and its odometry's drift allow",
          "[pose_graph]") {
  const MapState before = straight_map(40);
  GraphConfig config;
  const std::size_t bent = 30;
  const auto is_plausible = [&](double moved_m) {
    MapState after = before;
    after.T_session_keyframe[0][bent].translation.y() += moved_m;
    return deformation_is_plausible(before, after, 0, config);
  };
  SECTION("by the floor and its growth along the path") {
    config.deformation_floor_m = 4.0;
    CHECK(is_plausible(4.0 + 0.005 * 150.0 - 0.01));
    CHECK_FALSE(is_plausible(4.0 + 0.005 * 150.0 + 0.01));
  }
  SECTION("by three standard deviations of the drift") {
    config.deformation_floor_m = 0.0;
    const double sigma = std::sqrt(before.odometry[0].variance(0, bent).translation);
    CHECK(is_plausible(2.99 * sigma));
    CHECK_FALSE(is_plausible(3.01 * sigma));
  }
  SECTION("never by NaN") { CHECK_FALSE(is_plausible(std::nan(""))); }
}
