// Tests of the index of points by squares of the map.
#include "src/merge/near_points.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

using namespace unimapper;
using namespace unimapper::merge;

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
