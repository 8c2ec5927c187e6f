// Tests of the kd-tree of registration clouds.
#include "src/merge/point_tree.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "tests/merge/random.hpp"

using namespace unimapper;
using namespace unimapper::merge;
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
