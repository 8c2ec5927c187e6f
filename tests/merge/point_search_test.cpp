// Searches among points, and the distance between the walls of two clouds
#include "src/merge/map/near_points.hpp"
#include "src/merge/map/voxel_trees.hpp"
#include "src/merge/placements/wall_distance.hpp"
#include "src/merge/registration/point_tree.hpp"
#include "tests/merge/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using Cloud = std::vector<Eigen::Vector3f>;
using unimapper::merge::testing::Random;

namespace {

/// Points on a floor and a wall, so that halves are flat.
std::vector<Eigen::Vector3f> floor_and_wall(std::size_t count, Random& random) {
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p(random.uniform(-30, 30), i % 2 == 0 ? random.uniform(-30, 30) : 5.0,
                            i % 2 == 0 ? 0.0 : random.uniform(0, 6));
    points.emplace_back(p.cast<float>());
  }
  return points;
}

/// All points, the nearest first.
std::vector<PointTree::Neighbor> by_distance(const std::vector<Eigen::Vector3f>& points,
                                             const Eigen::Vector3f& query) {
  std::vector<PointTree::Neighbor> all;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    all.emplace_back((points[i] - query).squaredNorm(), i);
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

TEST_CASE("A tree finds the neighbours that a look at every point finds", "[registration]") {
  Random random(3);
  for (const std::size_t count : {1U, 7U, 8U, 9U, 17U, 500U, 3000U}) {
    const std::vector<Eigen::Vector3f> points = floor_and_wall(count, random);
    const PointTree tree(points);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3f query =
          Eigen::Vector3d(random.uniform(-40, 40), random.uniform(-40, 40), random.uniform(-5, 9))
              .cast<float>();
      const auto wanted = by_distance(points, query);

      float gate = std::numeric_limits<float>::infinity();
      CHECK(tree.nearest(query, gate) == wanted[0].second);
      CHECK(gate == Approx(wanted[0].first));

      PointTree::Neighbor found[12];
      REQUIRE(tree.nearest(query, found) == std::min<std::size_t>(count, 12));
      for (std::size_t n = 0; n < std::min<std::size_t>(count, 12); ++n) {
        CHECK(found[n].second == wanted[n].second);
      }
    }
  }
}

TEST_CASE("A tree finds nothing at the gate or beyond it", "[registration]") {
  const std::vector<Eigen::Vector3f> points{{3.0F, 0.0F, 0.0F}};
  const PointTree tree(points);
  float at = 9.0F;
  CHECK(tree.nearest(Eigen::Vector3f::Zero(), at) == PointTree::kNone);
  CHECK(at == 9.0F);
  float beyond = 9.1F;
  CHECK(tree.nearest(Eigen::Vector3f::Zero(), beyond) == 0);
  CHECK(beyond == 9.0F);

  float any = 100.0F;
  CHECK(PointTree({}).nearest(Eigen::Vector3f::Zero(), any) == PointTree::kNone);
}

namespace {

/// A street of so many metres along x, three points a metre.
std::vector<Eigen::Vector3f> street(int length_m) {
  std::vector<Eigen::Vector3f> points;
  for (int x = 0; x < length_m; ++x) {
    for (const float y : {-6.0F, 0.0F, 6.0F}) points.push_back({static_cast<float>(x), y, 1.0F});
  }
  return points;
}

}  // namespace

TEST_CASE("Every point within reach is near, in ascending order", "[changes]") {
  const std::vector<Eigen::Vector3f> points = street(500);
  const NearPoints index(points);
  for (const float x : {-3.0F, 0.0F, 7.99F, 8.0F, 250.3F, 499.0F}) {
    const Eigen::Vector3f centre(x, -0.5F, 0.0F);
    for (const float reach_m : {0.5F, 10.0F, 40.0F, 5000.0F}) {
      const std::vector<std::uint32_t> near = index.around(centre, reach_m);
      CHECK(std::is_sorted(near.begin(), near.end()));
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        if ((points[i] - centre).norm() > reach_m) continue;
        CHECK(std::binary_search(near.begin(), near.end(), i));
      }
    }
  }
}

TEST_CASE("What is looked at does not grow with the map", "[changes]") {
  const Eigen::Vector3f centre(250.0F, 0.0F, 0.0F);
  const auto looked_at = [&](int length_m) {
    const std::vector<Eigen::Vector3f> points = street(length_m);
    return NearPoints(points).around(centre, 40.0F).size();
  };
  CHECK(looked_at(500) == looked_at(5000));
  CHECK(looked_at(500) < 3 * (80 + 2 * 8 + 1));
}

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

TEST_CASE("Walls are as far apart as one cloud was moved across them", "[walls]") {
  // Two walls at a right angle, ground below; the wall's points are 10 cm apart.
  const auto room = [](float shift_x, float shift_y) {
    Cloud cloud;
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < 30; ++j) {
        const auto along = 0.1F * static_cast<float>(i);
        const auto up = 0.1F * static_cast<float>(j);
        cloud.push_back({along + shift_x, shift_y, up});
        cloud.push_back({shift_x, along + shift_y, up});
        cloud.push_back({along + 3.0F + shift_x, up + 3.0F + shift_y, 0.0F});
      }
    }
    return cloud;
  };
  const WallDistance same = wall_distance(room(0, 0), room(0, 0));
  CHECK(same.median_m < 1e-6);
  CHECK(same.points > 1000);
  const WallDistance moved = wall_distance(room(0.1F, 0.1F), room(0, 0));
  CHECK(moved.median_m == Approx(0.1).margin(0.01));
  CHECK(moved.p90_m < 0.2);
  // What lies along a wall says nothing across it.
  CHECK(wall_distance(room(0.1F, 0), room(0, 0)).median_m < 0.11);
  CHECK(wall_distance(room(50, 0), room(0, 0)).points == 0);
  CHECK(std::isnan(wall_distance({}, room(0, 0)).median_m));
}
