// Ground height grid around a keyframe: planes of its patches.
#include "src/place/local_ground.hpp"

#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;

using OwnedGround = Owned<LocalGround>;

DescriptorConfig config() {
  DescriptorConfig config;
  config.range_m = 20.0F;
  return config;
}

/// Height of a plane that rises by 0.1 along x and falls by 0.2 along y, metres.
float inclined(float x, float y) { return 3.0F + 0.1F * x - 0.2F * y; }

/// Cells of ground in the middle of the patch of 2 m around (x, y), odd numbers.
void add_patch(LocalGround& ground, float x, float y, float z, int cells = 1) {
  FineCell cell{};
  cell.position = {x, y, z};
  cell.ground = 1;
  for (int i = 0; i < cells; ++i) ground.add(cell);
}

std::vector<PlanePatch> planes_of(const LocalGround& ground, std::int32_t min_cells = 1) {
  std::vector<PlanePatch> planes;
  ground.for_each_plane(min_cells, [&](const PlanePatch& plane) { planes.push_back(plane); });
  return planes;
}

}  // namespace

TEST_CASE("the normals of inclined ground point up and towards its fall") {
  OwnedGround ground(config());
  ground->clear();
  for (float x = -9; x <= 9; x += 2) {
    for (float y = -9; y <= 9; y += 2) add_patch(*ground, x, y, inclined(x, y));
  }
  ground->finish();
  const std::vector<PlanePatch> planes = planes_of(*ground);
  REQUIRE(planes.size() == 100);
  // At the rim the slope follows from the neighbour on one side.
  const Eigen::Vector3f normal = Eigen::Vector3f(-0.1F, 0.2F, 1.0F).normalized();
  for (const PlanePatch& plane : planes) {
    CHECK((plane.normal - normal).norm() < 0.002F);  // heights are kept in millimetres
    CHECK(plane.center.z() == Approx(inclined(plane.center.x(), plane.center.y())).margin(0.002));
  }
  CHECK(ground->height(2.5F, -3.5F) == Approx(inclined(2.5F, -3.5F)).margin(0.002));
}

TEST_CASE("a patch is a plane if it has a neighbour along either axis and enough cells") {
  OwnedGround ground(config());
  const auto planes = [&](const std::vector<Eigen::Vector2f>& patches, int cells) {
    ground->clear();
    for (const Eigen::Vector2f& at : patches) add_patch(*ground, at.x(), at.y(), 3.0F, cells);
    ground->finish();
    return planes_of(*ground, 3).size();
  };
  CHECK(planes({{1, 1}, {3, 1}, {1, 3}}, 3) == 1);
  CHECK(planes({{1, 1}, {3, 1}, {1, 3}}, 2) == 0);
  CHECK(planes({{1, 1}, {3, 1}, {5, 1}}, 3) == 0);
  CHECK(planes({{1, 1}, {1, 3}, {1, 5}}, 3) == 0);
  CHECK(planes({{1, 1}, {3, 3}}, 3) == 0);
  CHECK(planes({{1, 1}, {3, 1}, {1, 3}, {3, 3}}, 3) == 4);
}

TEST_CASE("where no ground is seen it goes on as high as the nearest that is") {
  OwnedGround ground(config());
  ground->clear();
  for (float x = -15; x <= -9; x += 2) {
    for (float y = -9; y <= 9; y += 2) add_patch(*ground, x, y, -1.5F);
  }
  ground->finish();
  for (const float x : {-19.0F, -10.0F, 0.0F, 10.0F, 19.0F}) {
    for (const float y : {-19.0F, 0.0F, 19.0F}) {
      INFO("at " << x << ", " << y);
      CHECK(ground->height(x, y) == Approx(-1.5F));
    }
  }
}

TEST_CASE("ground rises no more than a steep road, whatever is marked as ground") {
  OwnedGround ground(config());
  ground->clear();
  for (float x = -15; x <= 15; x += 2) {
    // A flat roof beside a street.
    for (float y = -9; y <= 9; y += 2) add_patch(*ground, x, y, x < 0 ? 0.0F : 6.0F);
  }
  ground->finish();
  CHECK(ground->height(-5.0F, 1.0F) == Approx(0.0F).margin(0.001));
  CHECK(ground->height(5.0F, 1.0F) == Approx(0.6F * 3).margin(0.001));
  CHECK(ground->height(15.0F, 1.0F) == Approx(0.6F * 8).margin(0.001));
}
