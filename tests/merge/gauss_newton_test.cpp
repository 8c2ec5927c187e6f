// Gauss-Newton method: against the general solver
#include "src/merge/gauss_newton.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>

#include "src/merge/session_path.hpp"
#include "tests/merge/alignment_scene.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// Two laps of a drive, tied to each other by loops of which every fifth is wrong.
PoseGraph two_laps(std::uint64_t seed) {
  Random random(seed);
  constexpr std::size_t kLap = 60;
  std::vector<Pose> truth = drive(random, kLap, yaw_pose(0.7, {300.0, -200.0, 5.0}));
  truth.insert(truth.end(), truth.begin(), truth.end());
  const SessionPath measured(odometry(random, truth), OdometryNoiseConfig{});
  PoseGraph graph;
  graph.anchors.push_back({yaw_pose(2.0, {50.0, 60.0, 7.0}), true});
  for (std::size_t i = 0; i < truth.size(); ++i) {
    graph.nodes.push_back({measured[i], 0, i == 0});
    if (i == 0) continue;
    graph.edges.push_back(
        {i - 1, i, measured[i - 1].inverse() * measured[i], measured.information(i - 1, i), 0.0});
  }
  for (std::size_t i = 0; i < kLap; i += 4) {
    Pose seen = random.pose(0.2, 0.01);
    if (i % 20 == 0) seen.translation.y() += 8.0;
    graph.edges.push_back({kLap + i, i, seen, 25.0 * Matrix6d::Identity(), 3.5});
  }
  return graph;
}

}  // namespace

TEST_CASE("The Gauss-Newton method finds the minimum that the general solver finds",
          "[pose_graph]") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PoseGraph graph = two_laps(seed);
    PoseGraph expected = graph;
    REQUIRE(optimize(expected, 100).usable);
    const SolveSummary summary = optimize_one_map(graph, 100, 1e-9);
    REQUIRE(summary.usable);
    CHECK(summary.iterations < 30);
    CHECK(summary.final_cost < 0.7 * summary.initial_cost);
    CHECK(summary.final_cost == Approx(graph_cost(graph)));
    CHECK(summary.final_cost == Approx(graph_cost(expected)).epsilon(1e-6));
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
      CHECK(
          (graph.nodes[i].T_session_node.translation - expected.nodes[i].T_session_node.translation)
              .norm() < 0.01);
    }
  }
}

TEST_CASE("The Gauss-Newton method starts far away", "[pose_graph]") {
  PoseGraph graph = two_laps(6);
  PoseGraph expected = graph;
  REQUIRE(optimize_one_map(expected, 100, 1e-9).usable);
  Random random(7);
  for (std::size_t i = 1; i < graph.nodes.size(); ++i) {
    graph.nodes[i].T_session_node = graph.nodes[i].T_session_node * random.pose(2.0, 0.1);
  }
  CHECK(optimize_one_map(graph, 100, 1e-9).final_cost ==
        Approx(graph_cost(expected)).epsilon(1e-6));
}

TEST_CASE("A step that would raise the cost is damped", "[pose_graph]") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PoseGraph graph = two_laps(seed);
    Random random(seed);
    for (std::size_t i = 1; i < graph.nodes.size(); ++i) {
      graph.nodes[i].T_session_node = graph.nodes[i].T_session_node * random.pose(20.0, 1.5);
    }
    const double before = graph_cost(graph);
    const SolveSummary summary = optimize_one_map(graph, 200, 1e-9);
    REQUIRE(summary.usable);
    CHECK(summary.final_cost < 1e-3 * before);
    CHECK(summary.final_cost == Approx(graph_cost(graph)));
  }
}

TEST_CASE("A coarser tolerance ends earlier", "[pose_graph]") {
  PoseGraph fine = two_laps(8);
  PoseGraph coarse = fine;
  const SolveSummary first = optimize_one_map(coarse, 100, 1e-2);
  const SolveSummary last = optimize_one_map(fine, 100, 1e-9);
  CHECK(first.iterations < last.iterations);
  CHECK(first.final_cost < 1.05 * last.final_cost);
}

TEST_CASE("Fixed nodes and nodes that no edge reaches stay", "[pose_graph]") {
  PoseGraph graph = two_laps(9);
  graph.nodes[30].fixed = true;
  graph.nodes.push_back({yaw_pose(1.0, {1.0, 2.0, 3.0}), 0, false});
  const PoseGraph before = graph;
  REQUIRE(optimize_one_map(graph, 100, 1e-9).usable);
  const auto moved_m = [&](std::size_t i) {
    return (graph.nodes[i].T_session_node.translation - before.nodes[i].T_session_node.translation)
        .norm();
  };
  CHECK(moved_m(0) == 0.0);
  CHECK(moved_m(30) == 0.0);
  CHECK(moved_m(120) == 0.0);
  CHECK(moved_m(31) > 0.0);
}

TEST_CASE("The Gauss-Newton method refuses graphs of several maps and what the general one does",
          "[pose_graph]") {
  PoseGraph graph = two_laps(10);
  graph.edges[3].information.setZero();
  CHECK_THROWS_AS(optimize_one_map(graph, 10, 1e-9), std::invalid_argument);
  graph = two_laps(10);
  graph.anchors.push_back({Pose{}, false});
  CHECK_THROWS_AS(optimize_one_map(graph, 10, 1e-9), std::invalid_argument);
}
