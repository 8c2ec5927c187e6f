// Tests of the STD baseline on places with known matches.
//
// They pin the published weaknesses, too: a baseline that is better or worse than the original is
// no basis for a comparison.
#include "bench/places/std_baseline.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

using namespace unimapper;
using namespace unimapper::bench;

namespace {

using Cloud = std::vector<Eigen::Vector3f>;

constexpr float kGround = 0.3F;

/// Fine ground, and bushes above it.
class Park {
 public:
  explicit Park(std::uint32_t seed, std::uint32_t bushes = 60) : random_(seed) {
    for (int x = -100; x < 100; ++x) {
      for (int y = -100; y < 100; ++y) {
        const auto fx = static_cast<float>(x);
        const auto fy = static_cast<float>(y);
        cloud_.emplace_back(0.3F * fx + 0.05F, 0.3F * fy + 0.05F, kGround);
      }
    }
    std::uniform_real_distribution<float> position(-25.0F, 25.0F);
    for (std::uint32_t i = 0; i < bushes; ++i) {
      add_bush({position(random_), position(random_), 2.1F}, 60 + 3 * i);
    }
  }
  void add_bush(const Eigen::Vector3f& low, std::uint32_t points) {
    std::uniform_real_distribution<float> within(0.0F, 1.2F);
    for (std::uint32_t i = 0; i < points; ++i) {
      const Eigen::Vector3f offset(within(random_), within(random_), within(random_));
      cloud_.emplace_back(low + offset);
    }
  }
  [[nodiscard]] const Cloud& cloud() const { return cloud_; }
  /// Seen once more, with a sensor's noise.
  [[nodiscard]] Cloud seen_again(std::uint32_t seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<float> noise(0.0F, 0.01F);
    Cloud cloud;
    for (const Eigen::Vector3f& p : cloud_) {
      cloud.emplace_back(p + Eigen::Vector3f(noise(random), noise(random), noise(random)));
    }
    return cloud;
  }

 private:
  std::mt19937 random_;
  Cloud cloud_;
};

StdPlace describe(const Cloud& cloud, int scans = 1, const Pose& T_world_sensor = {}) {
  StdCloud accumulated;
  const PointView view = PointView::xyz(cloud.data(), cloud.size(), sizeof cloud[0]);
  for (int s = 0; s < scans; ++s) add_scan(view, T_world_sensor, accumulated);
  return describe_cloud(accumulated);
}

std::size_t count_planes(const StdVoxels& voxels) {
  return static_cast<std::size_t>(std::count_if(
      voxels.begin(), voxels.end(), [](const auto& voxel) { return voxel.second.plane; }));
}

StdKeypoint keypoint(const Eigen::Vector3d& position, double count = 20.0) {
  return {position, Eigen::Vector3d::UnitZ(), count};
}

/// Keypoints anywhere within 40 m, walls and ground.
StdPlace random_place(std::uint32_t seed, std::size_t keypoints = 40) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> position(-20.0, 20.0);
  std::uniform_int_distribution<int> count(10, 200);
  StdPlace place;
  for (std::size_t i = 0; i < keypoints; ++i) {
    place.keypoints.push_back(
        keypoint({position(random), position(random), 0.1 * position(random)}, count(random)));
    const Eigen::Vector3d at(position(random), position(random), position(random));
    place.planes.push_back({at, Eigen::Vector3d::Unit(static_cast<Eigen::Index>(i % 3))});
  }
  return place;
}

/// The same place in another frame.
StdPlace moved(StdPlace place, const Pose& T_new_old) {
  for (StdKeypoint& k : place.keypoints) {
    k.position = T_new_old * k.position;
    k.normal = T_new_old.rotation * k.normal;
  }
  for (StdPlane& plane : place.planes) {
    plane = {T_new_old * plane.center, T_new_old.rotation * plane.normal};
  }
  return place;
}

Pose some_pose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Eigen::Vector3d(0.1, -0.2, 1.0).normalized())),
          {120.0, -45.0, 3.0}};
}

/// One triangle of these sides, in units of the hash table.
StdPlace triangle_of(double a, double b, double c, double count = 20.0) {
  constexpr double kUnit_m = 0.2;
  const double x = (a * a + b * b - c * c) / (2.0 * a);
  const Eigen::Vector3d apex(x, std::sqrt(b * b - x * x), 0.0);
  StdPlace place;
  place.keypoints = {keypoint({0, 0, 0}, count), keypoint({kUnit_m * a, 0, 0}, count),
                     keypoint(kUnit_m * apex, count)};
  return place;
}

/// Whether one triangle alone finds the other.
bool finds(const StdPlace& query, const StdPlace& stored, StdConfig config = {}) {
  config.min_votes = 1;
  config.min_agreeing = 1;
  StdDatabase database(config);
  database.insert(stored);
  return database.search(query).has_value();
}

}  // namespace

TEST_CASE("voxels begin below zero and end above, exact negative multiples lie one lower") {
  const auto cell = [](double x) { return *cell_of({x, 1, 1}, 2.0); };
  CHECK(cell(0.0) == cell(1.9));
  CHECK(cell(2.0) == neighbour_cell(cell(0.0), {1, 0, 0}));
  CHECK(cell(-0.1) == neighbour_cell(cell(0.0), {-1, 0, 0}));
  CHECK(cell(-2.0) == neighbour_cell(cell(-1.9), {-1, 0, 0}));
  CHECK_FALSE(cell_of({1e9, 0, 0}, 2.0));
  CHECK_FALSE(cell_of({0, std::numeric_limits<double>::quiet_NaN(), 0}, 2.0));
}

TEST_CASE("a voxel of more than ten points on a line is a plane") {
  std::vector<Eigen::Vector3d> pole;
  pole.reserve(11);
  for (int i = 0; i < 10; ++i) pole.emplace_back(0.5, 0.5, 0.1 + 0.1 * i);
  CHECK(count_planes(find_voxels(pole)) == 0);
  pole.emplace_back(0.5, 0.5, 1.8);
  CHECK(count_planes(find_voxels(pole)) == 1);
}

TEST_CASE("nothing is projected onto a plane without a coplanar neighbour") {
  std::vector<Eigen::Vector3d> points;
  const auto add_ground = [&](double x) {
    for (int i = 0; i < 100; ++i) points.emplace_back(x + 0.2 * (i % 10), 0.2 * (i / 10), 0.3);
  };
  add_ground(0.0);
  for (int i = 0; i < 64; ++i) {
    points.emplace_back(0.2 + 0.2 * (i % 4), 0.2 + 0.2 * (i / 4 % 4), 2.1 + 0.3 * (i / 16));
  }
  CHECK(find_corners(find_voxels(points)).empty());
  add_ground(2.0);
  CHECK(find_corners(find_voxels(points)).size() == 1);
}

TEST_CASE("a bush becomes a keypoint on the ground below it, with its points counted") {
  Park park(1, 0);
  park.add_bush({4.3F, 8.3F, 2.1F}, 200);
  const StdPlace place = describe(park.cloud());
  REQUIRE(!place.keypoints.empty());
  const StdKeypoint& first = place.keypoints.front();
  CHECK(first.position.z() == Approx(kGround).margin(0.01));
  CHECK((first.position.head<2>() - Eigen::Vector2d(4.9, 8.9)).norm() < 0.9);
  CHECK(std::abs(first.normal.z()) == Approx(1.0).margin(1e-3));
  CHECK(first.count >= 10.0);
  CHECK(first.count < 200.0);
}

TEST_CASE("points are projected onto similar normals once, whichever voxel claims them") {
  Park park(1, 0);
  park.add_bush({5.4F, 9.4F, 2.1F}, 400);  // in four voxels
  std::vector<Eigen::Vector3d> points;
  points.reserve(park.cloud().size());
  for (const Eigen::Vector3f& p : park.cloud()) points.emplace_back(p.cast<double>());
  StdConfig config;
  config.segment_pixels = 1;
  config.corner_min_points = 1;
  double claimed = 0.0;
  for (const StdKeypoint& corner : find_corners(find_voxels(points), config)) {
    claimed += corner.count;
  }
  CHECK(claimed == 400.0);
}

TEST_CASE("counts grow with the number of scans") {
  const Park park(2, 1);
  const StdPlace once = describe(park.cloud());
  const StdPlace twice = describe(park.cloud(), 2);
  REQUIRE(!once.keypoints.empty());
  REQUIRE(!twice.keypoints.empty());
  CHECK(twice.keypoints.front().count == 2.0 * once.keypoints.front().count);
}

TEST_CASE("a description is the same every time") {
  const Park park(3);
  const StdPlace first = describe(park.cloud(), 1, some_pose());
  const StdPlace second = describe(park.cloud(), 1, some_pose());
  CHECK(first.keypoints.size() > 20);
  REQUIRE(first.keypoints.size() == second.keypoints.size());
  for (std::size_t i = 0; i < first.keypoints.size(); ++i) {
    CHECK(first.keypoints[i].position == second.keypoints[i].position);
  }
}

TEST_CASE("points that are not finite are ignored") {
  const Park park(4);
  Cloud spoilt = park.cloud();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  spoilt.emplace_back(nan, 0.0F, 0.0F);
  spoilt.emplace_back(0.0F, std::numeric_limits<float>::infinity(), 0.0F);
  spoilt.emplace_back(0.0F, 0.0F, 1e30F);
  CHECK(describe(spoilt).keypoints.size() == describe(park.cloud()).keypoints.size());
  CHECK(describe({{nan, nan, nan}}).planes.empty());
}

TEST_CASE("equal neighbours suppress each other, of others the fuller one stays") {
  const std::vector<StdKeypoint> corners = {
      keypoint({0, 0, 0}, 12), keypoint({1, 0, 0}, 12),    // equal
      keypoint({10, 0, 0}, 12), keypoint({11, 0, 0}, 13),  // not equal
      keypoint({20, 0, 0}, 50)};                           // alone
  const auto kept = select_keypoints(corners);
  REQUIRE(kept.size() == 2);
  CHECK(kept[0].count == 50.0);
  CHECK(kept[1].position.x() == 11.0);
  StdConfig config;
  config.max_keypoints = 1;
  CHECK(select_keypoints(corners, config).size() == 1);
  CHECK(select_keypoints({}).empty());
}

TEST_CASE("triangles are ordered by their sides") {
  const auto triangles =
      form_triangles({keypoint({0, 0, 0}, 1), keypoint({8, 0, 0}, 2), keypoint({0, 6, 0}, 3)});
  REQUIRE(triangles.size() == 1);
  CHECK(triangles[0].sides.isApprox(Eigen::Vector3d(30, 40, 50)));
  CHECK(triangles[0].counts == Eigen::Vector3d(1, 3, 2));
}

TEST_CASE("congruent triangles are stored once, wherever they are") {
  const StdPlace one = triangle_of(30, 40, 50);
  const StdPlace far = moved(one, {Eigen::Matrix3d::Identity(), {100, 0, 0}});
  StdPlace both = one;
  both.keypoints.insert(both.keypoints.end(), far.keypoints.begin(), far.keypoints.end());
  CHECK(form_triangles(both.keypoints).size() == 1);
  StdDatabase database;
  CHECK(database.insert(both) == 0);
  CHECK(database.insert(far) == 1);
}

TEST_CASE("too short and too long sides form no triangles") {
  CHECK(form_triangles(triangle_of(9, 20, 20).keypoints).empty());
  CHECK(form_triangles(triangle_of(140, 140, 151).keypoints).empty());
  CHECK(form_triangles(triangle_of(140, 140, 149).keypoints).size() == 1);
}

TEST_CASE("fewer keypoints than neighbours are handled") {
  for (std::size_t keypoints = 0; keypoints < 6; ++keypoints) {
    const StdPlace place = random_place(5, keypoints);
    StdDatabase database;
    database.insert(place);
    CHECK(form_triangles(place.keypoints).size() <= keypoints * keypoints * keypoints);
    CHECK_FALSE(StdDatabase().search(place));
    CHECK_NOTHROW(database.search(place));
  }
}

TEST_CASE("a place is found among others, with the pose between the frames") {
  StdDatabase database;
  for (std::uint32_t seed = 10; seed < 20; ++seed) database.insert(random_place(seed));
  const Pose T_match_query = some_pose();
  const auto loop = database.search(moved(random_place(16), T_match_query.inverse()));
  REQUIRE(loop);
  CHECK(loop->match == 6);
  CHECK(loop->score == Approx(1.0));
  CHECK(loop->votes > 100);
  CHECK((loop->T_match_query.translation - T_match_query.translation).norm() < 1e-6);
  CHECK((loop->T_match_query.rotation - T_match_query.rotation).norm() < 1e-6);
}

TEST_CASE("sides may differ by a share of the triangle's size") {
  const auto grown = [](double by) { return triangle_of(50.1 * by, 60.1 * by, 70.1 * by); };
  CHECK(finds(grown(1.0), grown(0.988)));
  CHECK_FALSE(finds(grown(1.0), grown(0.984)));
}

TEST_CASE("the hash look-up reaches further down than up") {
  StdConfig config;
  config.side_tolerance = 1.0;
  const StdPlace query = triangle_of(50.9, 60.2, 70.2);
  CHECK(finds(query, triangle_of(48.9, 60.2, 70.2), config));
  CHECK(finds(query, triangle_of(51.4, 60.2, 70.2), config));
  CHECK_FALSE(finds(query, triangle_of(51.6, 60.2, 70.2), config));
  // A corner cell's centre is too far, though each of its sides would do.
  CHECK_FALSE(finds(triangle_of(50.9, 60.9, 70.9), triangle_of(48.9, 58.9, 68.9), config));
}

TEST_CASE("other point density finds nothing unless counts may differ more") {
  const StdPlace query = triangle_of(50, 60, 70, 30.0);
  CHECK(finds(query, triangle_of(50, 60, 70, 49.0)));
  CHECK_FALSE(finds(query, triangle_of(50, 60, 70, 51.0)));
  StdConfig config;
  config.count_tolerance = 1.0;
  CHECK(finds(query, triangle_of(50, 60, 70, 51.0), config));
}

TEST_CASE("too few votes give no candidate, too few agreeing triangles no loop") {
  const StdPlace place = triangle_of(50, 60, 70);
  const auto is_found = [&](std::uint32_t min_votes, std::uint32_t min_agreeing) {
    StdConfig config;
    config.min_votes = min_votes;
    config.min_agreeing = min_agreeing;
    StdDatabase database(config);
    database.insert(place);
    return database.search(place).has_value();
  };
  CHECK(is_found(1, 1));
  CHECK_FALSE(is_found(2, 1));
  CHECK_FALSE(is_found(1, 2));
}

TEST_CASE("ground overlaps with ground, however far away") {
  StdPlace stored = random_place(41);
  StdPlace query = stored;
  stored.planes.clear();
  query.planes.clear();
  for (int i = 0; i < 10; ++i) {
    stored.planes.push_back({{2.0 * i, 0, 0}, Eigen::Vector3d::UnitZ()});
    query.planes.push_back({{1000.0 + 2.0 * i, 0, 0.4}, -Eigen::Vector3d::UnitZ()});
  }
  query.planes.push_back({{0, 0, 1}, Eigen::Vector3d::UnitZ()});  // above
  query.planes.push_back({{0, 0, 0}, Eigen::Vector3d::UnitX()});  // upright
  StdDatabase database;
  database.insert(stored);
  const auto loop = database.search(query);
  REQUIRE(loop);
  CHECK(loop->score == Approx(10.0 / 12.0));
}

TEST_CASE("a loop is reported however low its score is") {
  StdPlace query = random_place(51);
  StdDatabase database;
  database.insert(query);
  query.planes.clear();
  const auto loop = database.search(query);
  REQUIRE(loop);
  CHECK(loop->score == 0.0);
}

TEST_CASE("a scene scanned twice matches itself") {
  StdDatabase database;
  for (std::uint32_t seed = 60; seed < 64; ++seed) {
    database.insert(describe(Park(seed).seen_again(1)));
  }
  const auto loop = database.search(describe(Park(62).seen_again(2)));
  REQUIRE(loop);
  CHECK(loop->match == 2);
  CHECK(loop->score > StdConfig::kAcceptScore);
  CHECK(loop->T_match_query.translation.norm() < 1.0);
  CHECK(rotation_angle(loop->T_match_query.rotation) < 0.05);
}
