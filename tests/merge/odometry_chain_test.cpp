// Odometry over several keyframes as one measurement: against the graph of all of them
#include "src/merge/odometry_chain.hpp"

#include <catch2/catch.hpp>

#include "tests/merge/alignment_scene.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

SessionPath winding_path(Random& random, std::size_t count) {
  std::vector<Pose> poses = odometry(random, drive(random, count, Pose{}));
  for (std::size_t i = 0; i < count; ++i) {
    poses[i] = poses[i] * yaw_pose(0.0, {0.0, 0.0, 0.3 * static_cast<double>(i % 5)});
  }
  return {poses, OdometryNoiseConfig{}};
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
    const SessionPath path = winding_path(random, kCount);
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
    CHECK((poses[k].translation - (moved * path[k]).translation).norm() < 1e-9);
  }
}
