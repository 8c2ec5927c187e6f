// Visible extent of a place, and the share of planes that coincide.
#include "src/place/plane_overlap.hpp"

#include "synthetic_place.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;

PlanePatch wall(float x, float y, float z) { return {{x, y, z}, {-1, 0, 0}}; }

/// Walls across the x axis, up to 3 m high, in rows 4 m apart; of each row 2 m apart.
std::vector<PlanePatch> walls(float first_x, float half_width) {
  std::vector<PlanePatch> planes;
  for (float x = first_x; x <= first_x + 12; x += 4) {
    for (float y = -half_width; y <= half_width; y += 2) {
      for (float z = -1; z <= 3; z += 2) planes.push_back(wall(x, y, z));
    }
  }
  return planes;
}

/// In the middle of voxels of 2 m: 72 of them, 24 of each height. Whole numbers, so that quarter
/// turns and steps of 2 m keep them exactly.
std::vector<PlanePatch> centred_walls() { return walls(9, 5); }

/// Without those at a height of 1 m.
std::vector<PlanePatch> without_middle(std::vector<PlanePatch> planes) {
  std::erase_if(planes, [](const PlanePatch& patch) { return patch.center.z() == 1.0F; });
  return planes;
}

std::vector<PlanePatch> moved(std::vector<PlanePatch> planes, const Pose& pose) {
  for (PlanePatch& patch : planes) {
    patch.center = (pose * Eigen::Vector3d(patch.center.cast<double>())).cast<float>();
    patch.normal = (pose.rotation * patch.normal.cast<double>()).cast<float>();
  }
  return planes;
}

/// A quarter turn to the left, then a shift: exact.
Pose quarter_turn(const Eigen::Vector3d& shift) {
  Pose pose;
  pose.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  pose.translation = shift;
  return pose;
}

}  // namespace

TEST_CASE("a place sees as far as its farthest plane in a direction, and as high as its highest") {
  VisibleExtent extent{};
  extent.build(walls(8, 6));
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
  const std::vector<PlanePatch> all = walls(8, 6);
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

TEST_CASE("planes of either place are moved into the other one's frame") {
  Owned<PlaneOverlap> overlap(100U, 2.0F);
  const std::vector<PlanePatch> all = centred_walls();
  REQUIRE(all.size() == 72);
  for (const Pose& T_match_query : {Pose{}, quarter_turn({4, -2, 0}), quarter_turn({-2, 6, 0})}) {
    const std::vector<PlanePatch> query = moved(all, T_match_query.inverse());
    overlap->set_match(all);
    overlap->set_query(query);
    const OverlapResult same = overlap->compare(T_match_query);
    CHECK(same.overlap == Approx(1.0F));
    CHECK(same.upright_overlap == Approx(1.0F));
    CHECK(same.upright == 2 * 72);
  }
}

TEST_CASE("planes that one of two places lacks count once among those of both") {
  Owned<PlaneOverlap> overlap(100U, 2.0F);
  const std::vector<PlanePatch> all = centred_walls();
  const std::vector<PlanePatch> fewer = without_middle(all);
  REQUIRE(fewer.size() == 48);
  const Pose T_match_query = quarter_turn({0, 0, 0});
  const auto check = [&](const std::vector<PlanePatch>& match,
                         const std::vector<PlanePatch>& query) {
    const std::vector<PlanePatch> turned = moved(query, T_match_query.inverse());
    overlap->set_match(match);
    overlap->set_query(turned);
    const OverlapResult result = overlap->compare(T_match_query);
    // 48 of 48 in one direction, 48 of 72 in the other.
    CHECK(result.upright == 96);
    CHECK(result.overlap == Approx(96.0F / 120.0F));
    CHECK(result.upright_overlap == Approx(96.0F / 120.0F));
  };
  check(all, fewer);
  check(fewer, all);
}

TEST_CASE("a level plane counts a fifth of an upright one") {
  Owned<PlaneOverlap> overlap(100U, 2.0F);
  const std::vector<PlanePatch> walls_only = centred_walls();
  std::vector<PlanePatch> with_ground = walls_only;
  for (float y = -5; y <= 5; y += 2) with_ground.push_back({{11, y, -1}, {0, 0, 1}});
  overlap->set_match(with_ground);
  overlap->set_query(with_ground);
  CHECK(overlap->compare(Pose{}).overlap == Approx(1.0F));
  CHECK(overlap->compare(Pose{}).upright == 2 * 72);
  overlap->set_query(walls_only);
  const OverlapResult result = overlap->compare(Pose{});
  CHECK(result.overlap == Approx(144.0F / (144.0F + 0.2F * 6.0F)));
  CHECK(result.upright_overlap == Approx(1.0F));
  CHECK(result.upright == 2 * 72);
}
