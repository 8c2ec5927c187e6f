#include <catch2/catch.hpp>

#include "src/merge/free_space_view.hpp"
#include "src/merge/max_clique.hpp"
#include "src/merge/voxel_trees.hpp"
#include "tests/merge/random.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Random;

TEST_CASE("Per-voxel kd-trees find neighbours across the voxels' faces", "[changes]") {
  Random random(1);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 3000; ++i) {
    points.emplace_back(static_cast<float>(random.uniform(-10.0, 10.0)),
                        static_cast<float>(random.uniform(-10.0, 10.0)),
                        static_cast<float>(random.uniform(-3.0, 3.0)));
  }
  const VoxelTrees trees(points, 2.0F);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3f query(static_cast<float>(random.uniform(-11.0, 11.0)),
                                static_cast<float>(random.uniform(-11.0, 11.0)),
                                static_cast<float>(random.uniform(-4.0, 4.0)));
    bool near = false;
    for (const auto& p : points) near = near || (p - query).squaredNorm() < 0.25F;
    CHECK(trees.has_neighbor(query, 0.5F) == near);
  }
}

TEST_CASE("In front of a wall is free, at it occupied, behind it and beside it unknown",
          "[changes]") {
  KeyframeRecord keyframe;
  for (float y = -8.0F; y <= 8.0F; y += 0.2F) {
    for (float z = -2.0F; z <= 4.0F; z += 0.2F) {
      keyframe.static_cells.push_back({Eigen::Vector3f(12.0F, y, z), 3, 0, 0});
    }
  }
  const FreeSpaceView view(keyframe);
  CHECK(view.look({8.0F, 0.0F, 0.5F}, 0.6F) == Visibility::kFree);
  CHECK(view.look({12.1F, 0.0F, 0.5F}, 0.6F) == Visibility::kOccupied);
  CHECK(view.look({15.0F, 0.0F, 0.5F}, 0.6F) == Visibility::kUnknown);
  CHECK(view.look({-8.0F, 0.0F, 0.5F}, 0.6F) == Visibility::kUnknown);
  CHECK(view.look({8.0F, 0.0F, 30.0F}, 0.6F) == Visibility::kUnknown);
}

TEST_CASE("What moved hides what is behind it", "[changes]") {
  KeyframeRecord keyframe;
  for (float y = -8.0F; y <= 8.0F; y += 0.2F) {
    for (float z = -2.0F; z <= 4.0F; z += 0.2F) {
      keyframe.static_cells.push_back({Eigen::Vector3f(12.0F, y, z), 3, 0, 0});
      keyframe.dynamic_cells.push_back({Eigen::Vector3f(4.0F, 0.4F * y, 0.4F * z), 3, 0, 0});
    }
  }
  const FreeSpaceView view(keyframe);
  CHECK(view.look({8.0F, 0.0F, 0.5F}, 0.6F) == Visibility::kUnknown);
  CHECK(view.look({2.0F, 0.0F, 0.1F}, 0.6F) == Visibility::kFree);
}

TEST_CASE("The clique search finds the largest group hidden in noise", "[acceptance]") {
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const std::size_t n = 60;
    AdjacencyMatrix graph(n);
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = a + 1; b < n; ++b) {
        const bool hidden = a % 5 == 0 && b % 5 == 0;
        if (hidden || random.uniform() < 0.2) graph.connect(a, b);
      }
    }
    std::vector<std::size_t> all(n);
    for (std::size_t i = 0; i < n; ++i) all[i] = i;
    const auto clique = max_clique(graph, all);
    CHECK(clique.size() >= 12);
    for (std::size_t i = 0; i < clique.size(); ++i) {
      for (std::size_t j = i + 1; j < clique.size(); ++j) {
        CHECK(graph.connected(clique[i], clique[j]));
      }
    }
    // Out of steps, the greedy answer is still a clique.
    CHECK(max_clique(graph, all, 30).size() >= 2);
  }
  CHECK(max_clique(AdjacencyMatrix(0), {}).empty());
}
