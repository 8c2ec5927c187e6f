// Tests of the place descriptor: invariances and dependencies.
#include "unimapper/place/describer.hpp"

#include "described.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::test;

bool identical(const Description& a, const Description& b) {
  const auto same_keypoint = [](const Keypoint& p, const Keypoint& q) {
    return p.position == q.position && p.normal == q.normal && p.occupancy == q.occupancy &&
           p.strength == q.strength;
  };
  const auto same_plane = [](const PlanePatch& p, const PlanePatch& q) {
    return p.center == q.center && p.normal == q.normal;
  };
  return std::equal(a.keypoints.begin(), a.keypoints.end(), b.keypoints.begin(), b.keypoints.end(),
                    same_keypoint) &&
         std::equal(a.planes.begin(), a.planes.end(), b.planes.begin(), b.planes.end(), same_plane);
}

/// Ground and a post of four metres.
const std::vector<Surface> kPost = {{{-30, -30, 0}, {60, 0, 0}, {0, 60, 0}, true},
                                    {{8, 0, 0}, {0.2, 0, 0}, {0, 0, 4}, false}};

// Share of the first description's stronger keypoints that the second one has too, within
// `radius`. `T_b_a` relates the frames; only keypoints well within both ranges count.
double repeated(const Description& a, const Description& b, const Pose& T_b_a,
                double radius = 0.5) {
  int found = 0;
  int total = 0;
  for (std::size_t i = 0; i < a.keypoints.size() && i < 40; ++i) {
    const Keypoint& keypoint = a.keypoints[i];
    const Eigen::Vector3d p = T_b_a * keypoint.position.cast<double>();
    if (p.head<2>().norm() > 44.0 || keypoint.position.head<2>().norm() > 44.0F) continue;
    ++total;
    found += std::any_of(b.keypoints.begin(), b.keypoints.end(), [&](const Keypoint& other) {
      return (other.position.cast<double>() - p).head<2>().norm() < radius;
    });
  }
  return total == 0 ? 0.0 : static_cast<double>(found) / total;
}

void require_sound(const Description& description) {
  for (const Keypoint& keypoint : description.keypoints) {
    REQUIRE(keypoint.position.allFinite());
    REQUIRE(keypoint.normal.norm() == Approx(1.0).margin(1e-4));
    REQUIRE(keypoint.occupancy != 0);
  }
  for (const PlanePatch& patch : description.planes) {
    REQUIRE(patch.center.allFinite());
    REQUIRE(patch.normal.norm() == Approx(1.0).margin(1e-4));
    REQUIRE(patch.normal.dot(patch.center) <= 1e-4F);  // towards the sensor
  }
}

void shuffle(std::vector<FineCell>& cells, std::uint64_t seed) {
  Random random(seed);
  for (std::size_t i = cells.size(); i > 1; --i) {
    const auto j = static_cast<std::size_t>(random.uniform() * static_cast<double>(i));
    std::swap(cells[i - 1], cells[j]);
  }
}

}  // namespace

TEST_CASE("corners of blocks and posts become keypoints, standing on the ground") {
  std::vector<Surface> surfaces = {{{-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, true},
                                   {{10, -6, 0}, {0, 12, 0}, {0, 0, 5}, false},
                                   {{10, 6, 0}, {8, 0, 0}, {0, 0, 5}, false},
                                   {{-12, 3, 0}, {0.2, 0, 0}, {0, 0, 4}, false},
                                   {{-12, 3, 0}, {0, 0.2, 0}, {0, 0, 4}, false}};
  const Description description = describe(observe(surfaces, standing_at(0, 0, 1.9, 0)));
  require_sound(description);
  // A turn, two ends and a post come out strong; nothing on the long wall between does.
  std::uint16_t weakest = 65535;
  for (const Eigen::Vector2f& expected : {Eigen::Vector2f(10, 6), Eigen::Vector2f(10, -6),
                                          Eigen::Vector2f(18, 6), Eigen::Vector2f(-12, 3)}) {
    float nearest = 1e9F;
    std::uint16_t strength = 0;
    for (const Keypoint& keypoint : description.keypoints) {
      CHECK(keypoint.position.z() == Approx(-1.9F).margin(0.1));
      const float distance = (keypoint.position.head<2>() - expected).norm();
      if (distance >= nearest) continue;
      nearest = distance;
      strength = keypoint.strength;
    }
    INFO("expected near " << expected.transpose());
    CHECK(nearest < 1.0F);
    weakest = std::min(weakest, strength);
  }
  for (const Keypoint& keypoint : description.keypoints) {
    const bool mid_wall =
        std::abs(keypoint.position.x() - 10) < 1.0F && std::abs(keypoint.position.y()) < 3.5F;
    if (mid_wall) CHECK(keypoint.strength < weakest);
  }
}

TEST_CASE("a keypoint carries the normal of the wall it borders, else of the ground") {
  std::vector<Surface> surfaces = kPost;
  surfaces.push_back({{-10, -6, 0}, {0, 12, 0}, {0, 0, 5}, false});
  const Description description = describe(observe(surfaces, standing_at(0, 0, 1.9, 0)));
  REQUIRE(description.keypoints.size() >= 3);
  bool post_seen = false;
  for (const Keypoint& keypoint : description.keypoints) {
    const bool of_post = keypoint.position.x() > 0.0F;
    post_seen = post_seen || of_post;
    CHECK((of_post ? keypoint.normal.z() > 0.99F : std::abs(keypoint.normal.x()) > 0.97F));
  }
  CHECK(post_seen);
}

TEST_CASE(
    "a roof marked as ground, or a reflection below it, moves keypoints up by a ramp at most") {
  std::vector<Surface> street = kPost;
  street.push_back({{-9, 7, 0}, {0.2, 0, 0}, {0, 0, 4}, false});
  std::vector<Surface> spoiled = street;
  spoiled.push_back({{7, -4, 6}, {6, 0, 0}, {0, 8, 0}, true});
  const Pose here = standing_at(0, 0, 1.2, 0);
  const Description clean = describe(observe(street, here));
  std::vector<FineCell> cells = observe(spoiled, here);
  FineCell reflection = cells.front();
  reflection.position = {-33.0F, 7.0F, -20.0F};
  reflection.ground = 1;
  cells.push_back(reflection);
  const Description description = describe(cells);
  REQUIRE(clean.keypoints.size() == 2);
  REQUIRE(description.keypoints.size() == 2);
  for (const Keypoint& keypoint : clean.keypoints) {
    CHECK(keypoint.position.z() == Approx(-1.2).margin(0.1));
  }
  for (const Keypoint& keypoint : description.keypoints) {
    CHECK(keypoint.position.z() > -1.3F);
    CHECK(keypoint.position.z() < -0.2F);  // the roof alone would make it +1.8
  }
}

TEST_CASE("the columns of a keypoint say which heights are occupied") {
  // Slices of 0.2 m from the lowest height that counts up to the top.
  const Description description = describe(observe(kPost, standing_at(0, 0, 1.2, 0.3)));
  REQUIRE(description.keypoints.size() == 1);
  const std::uint64_t code = description.keypoints[0].occupancy;
  CHECK((code & 0x1U) == 0);                 // below 0.3 m
  CHECK(((code >> 4U) & 0xFFFU) == 0xFFFU);  // 0.8 to 3.2 m
  CHECK((code >> 21U) == 0);                 // above 4.2 m
}

TEST_CASE("neither the order of the cells nor their points matter, to the last bit") {
  std::vector<FineCell> cells = observe(make_scene(11), standing_at(1, 2, 1.9, 0.4));
  const Description before = describe(cells);
  REQUIRE(before.keypoints.size() > 20);
  REQUIRE(before.planes.size() > 100);
  require_sound(before);
  for (const std::uint64_t seed : {1U, 2U}) {
    shuffle(cells, seed);
    REQUIRE(identical(describe(cells), before));
  }
  // Nor does the number of points in each.
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i].points = static_cast<std::uint16_t>(1 + i % 1000);
  }
  REQUIRE(identical(describe(cells), before));
}

TEST_CASE("describing twice gives the same, whatever was described between") {
  const std::vector<FineCell> first = observe(make_scene(11), standing_at(0, 0, 1.9, 0));
  const std::vector<FineCell> second = observe(make_scene(12), standing_at(0, 0, 1.9, 0));
  Owned<PlaceDescriber> describer(DescriptorConfig{});
  const Description before(describer->describe(first));
  (void)describer->describe(second);
  REQUIRE(identical(Description(describer->describe(first)), before));
}

TEST_CASE("most keypoints are found again from elsewhere") {
  const std::vector<Surface> scene = make_scene(13);
  const Pose here = standing_at(0, 0, 1.9, 0.2);
  const Description reference = describe(observe(scene, here));
  const auto repeated_from = [&](const Pose& pose, const View& view) {
    const Pose T_other_here = level_frame(pose).inverse() * level_frame(here);
    return repeated(reference, describe(observe(scene, pose, view)), T_other_here);
  };
  View view;
  view.noise_seed = 2;
  SECTION("the other way round and beside") {
    CHECK(repeated_from(standing_at(4, 3, 1.9, 3.3), view) > 0.8);
  }
  SECTION("at another phase of the grid") {
    view.grid_shift = {0.11, 0.07, 0.13};
    CHECK(repeated_from(here, view) > 0.7);
  }
  SECTION("by a robot whose sensor is a metre and a half lower") {
    CHECK(repeated_from(standing_at(2, -1, 0.4, 1.0), view) > 0.8);
  }
  SECTION("with a fifth of the points") {
    view.spacing_m = 0.25;
    view.noise_m = 0.03;
    CHECK(repeated_from(standing_at(2, -1, 1.9, 1.0), view) > 0.7);
  }
  SECTION("without any cell marked as ground") {
    view.mark_ground = false;
    CHECK(repeated_from(standing_at(2, -1, 1.9, 1.0), view) > 0.7);
  }
}

TEST_CASE("roll, pitch and a far origin of the odometry frame change nothing") {
  const std::vector<Surface> scene = make_scene(14);
  const Pose here = standing_at(3, 1, 1.9, 0.7);
  const Description reference = describe(observe(scene, here));

  SECTION("the sensor tilts in a level world") {
    Pose tilted = here;
    tilted.rotation = here.rotation * (Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()) *
                                       Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitY()))
                                          .toRotationMatrix();
    const Pose T_other_here = level_frame(tilted).inverse() * level_frame(here);
    CHECK(repeated(reference, describe(observe(scene, tilted)), T_other_here) > 0.7);
  }
  SECTION("the world lies elsewhere") {
    const Pose T_far_near(Eigen::AngleAxisd(2.39, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                          {50000.13, -30000.37, 120.0});
    const std::vector<FineCell> cells = observe(moved(scene, T_far_near), T_far_near * here);
    CHECK(repeated(reference, describe(cells), Pose{}) > 0.7);
  }
  SECTION("the world's vertical is two degrees off") {
    const Pose T_off_true(Eigen::AngleAxisd(0.035, Eigen::Vector3d::UnitX()).toRotationMatrix(),
                          {100, 20, -3});
    const Pose there = T_off_true * here;
    const Pose T_other_here = level_frame(there).inverse() * T_off_true * level_frame(here);
    CHECK(repeated(reference, describe(observe(moved(scene, T_off_true), there)), T_other_here) >
          0.7);
  }
}

TEST_CASE("no cells, a single cell and broken cells are described without harm") {
  CHECK(describe({}).keypoints.empty());
  CHECK(describe({}).planes.empty());
  FineCell cell{};
  cell.position = {5, 5, 1};
  require_sound(describe({cell}));

  std::vector<FineCell> cells = observe(make_scene(11), standing_at(0, 0, 1.9, 0));
  const Description before = describe(cells);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  for (const Eigen::Vector3f& bad :
       {Eigen::Vector3f(nan, 0, 0), Eigen::Vector3f(0, inf, 0), Eigen::Vector3f(0, 0, -inf),
        Eigen::Vector3f(3e38F, 3e38F, 0), Eigen::Vector3f(1, 1, 1e30F)}) {
    cell.position = bad;
    cells.insert(cells.begin(), cell);
  }
  REQUIRE(identical(describe(cells), before));
  Owned<PlaceDescriber> describer(DescriptorConfig{});
  (void)describer->describe(cells);
  REQUIRE(describer->dropped() >= 3);

  // Everything in one spot.
  require_sound(describe(std::vector<FineCell>(50000, cells.back())));
}

TEST_CASE("input beyond capacity is counted and the rest is described") {
  const std::vector<FineCell> cells = observe(make_scene(11), standing_at(0, 0, 1.9, 0));
  DescriptorConfig config;
  config.max_keypoints = 8;
  config.max_planes = 20;
  SECTION("planes and keypoints") {}
  DescriptorInput input;
  SECTION("cells") { input.max_cells = 1000; }
  SECTION("voxels") { config.max_voxels = 16; }
  REQUIRE(config.validate().code == ErrorCode::kOk);
  Owned<PlaceDescriber> describer(config, input);
  REQUIRE(describer.ok());
  const PlaceView place = describer->describe(cells);
  REQUIRE(place.keypoints.size() <= 8);
  REQUIRE(place.planes.size() <= 20);
  REQUIRE(describer->dropped() > 0);
  require_sound(Description(place));
}

TEST_CASE("of too many cells a share from everywhere is described, not the first ones") {
  std::vector<FineCell> cells = observe(make_scene(31), standing_at(0, 0, 1.9, 0));
  std::sort(cells.begin(), cells.end(),
            [](const FineCell& a, const FineCell& b) { return a.position.x() < b.position.x(); });
  const auto structure = static_cast<std::uint32_t>(
      std::count_if(cells.begin(), cells.end(), [](const FineCell& c) { return c.ground == 0; }));
  const auto sides = [&](std::uint32_t max_cells, std::uint64_t dropped) {
    DescriptorInput input;
    input.max_cells = max_cells;
    Owned<PlaceDescriber> describer(DescriptorConfig{}, input);
    const PlaceView place = describer->describe(cells);
    CHECK(describer->dropped() >= dropped);
    const auto east = std::count_if(place.keypoints.begin(), place.keypoints.end(),
                                    [](const Keypoint& k) { return k.position.x() > 5.0F; });
    const auto west = std::count_if(place.keypoints.begin(), place.keypoints.end(),
                                    [](const Keypoint& k) { return k.position.x() < -5.0F; });
    return std::pair(west, east);
  };
  const auto [all_west, all_east] = sides(structure, 0);
  REQUIRE(all_west > 10);
  REQUIRE(all_east > 10);
  const auto [west, east] = sides(structure * 4 / 10, structure * 5 / 10);
  CHECK(3 * west > all_west);
  CHECK(3 * east > all_east);
}
