// Visible extent of a place, and the share of planes that coincide.
#include "src/place/plane_overlap.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "synthetic_place.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;

PlanePatch wall(float x, float y, float z) { return {{x, y, z}, {-1, 0, 0}}; }

/// A row of walls across the x axis, 8 to 20 m ahead, up to 3 m high.
std::vector<PlanePatch> walls() {
  std::vector<PlanePatch> planes;
  for (float x = 8; x <= 20; x += 4) {
    for (float y = -6; y <= 6; y += 2) {
      for (float z = -1; z <= 3; z += 2) planes.push_back(wall(x, y, z));
    }
  }
  return planes;
}

}  // namespace

TEST_CASE("a place sees as far as its farthest plane in a direction, and as high as its highest") {
  VisibleExtent extent{};
  extent.build(walls());
  CHECK(extent.contains({18, 0, 0}));
  CHECK_FALSE(extent.contains({30, 0, 0}));
  CHECK_FALSE(extent.contains({-18, 0, 0}));
  // The steepest rays hit 3 m at 8 m and -1 m at 8 m.
  CHECK(extent.contains({16, 0, 5.5F}));
  CHECK_FALSE(extent.contains({16, 0, 8}));
  CHECK_FALSE(extent.contains({16, 0, -4}));
  // Near the sensor a metre of height is any slope.
  CHECK(extent.contains({3, 0, 8}));
}

TEST_CASE("planes that only one place can see do not count against the other") {
  Owned<PlaneOverlap> overlap(100U, 2.0F);
  const std::vector<PlanePatch> all = walls();
  std::vector<PlanePatch> taller = all;
  for (float y = -6; y <= 6; y += 2) taller.push_back(wall(12, y, 15));
  overlap->set_match(all);
  overlap->set_query(all);
  CHECK(overlap->compare(Pose{}).overlap == Approx(1.0F));
  overlap->set_query(taller);
  CHECK(overlap->compare(Pose{}).overlap == Approx(1.0F));
  // ... but those it should have seen do.
  std::vector<PlanePatch> fuller = all;
  for (float y = -6; y <= 6; y += 2) fuller.push_back(wall(14, y, 1));
  overlap->set_query(fuller);
  CHECK(overlap->compare(Pose{}).overlap < 0.97F);
}
