// Tests of changed objects, made of changed voxels.
#include "src/merge/map/changed_objects.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

constexpr float kVoxel_m = 0.2F;

/// Voxels of a block that begins at `corner`, counts of voxels along the axes.
std::vector<ComparedVoxel> block(const Eigen::Vector3f& corner, const Eigen::Vector3i& size,
                                 Presence presence, Votes own = {0, 3}) {
  std::vector<ComparedVoxel> voxels;
  for (int x = 0; x < size.x(); ++x) {
    for (int y = 0; y < size.y(); ++y) {
      for (int z = 0; z < size.z(); ++z) {
        const Eigen::Vector3f p = corner + kVoxel_m * Eigen::Vector3i(x, y, z).cast<float>().eval();
        voxels.push_back({p, presence, 1, own});
      }
    }
  }
  return voxels;
}

/// A car's worth of voxels.
std::vector<ComparedVoxel> car(const Eigen::Vector3f& corner, Presence presence = Presence::kFree,
                               Votes own = {0, 3}) {
  return block(corner, {20, 9, 7}, presence, own);
}

std::vector<ComparedVoxel> together(std::vector<ComparedVoxel> a,
                                    const std::vector<ComparedVoxel>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

ChangedObject object_at(ChangeKind kind, std::uint32_t session, std::uint32_t free_in,
                        const Eigen::Vector3d& centre, const Eigen::Vector3d& size) {
  ChangedObject object;
  object.kind = kind;
  object.session = session;
  object.free_in = free_in;
  object.box = {centre, 0.0, size};
  object.voxels = 100;
  object.confidence = kind == ChangeKind::kGone ? 0.8 : 0.9;
  return object;
}

std::size_t objects_in(const std::vector<ComparedVoxel>& voxels, const MapConfig& config = {}) {
  return group_changes(voxels, config).size();
}

}  // namespace

TEST_CASE("Voxels that changed near each other are one object", "[changes]") {
  const auto with_gap = [](float gap_m) {
    const float next = 20.0F * kVoxel_m - kVoxel_m + gap_m;
    return objects_in(together(car({0, 0, 0}), car({next, 0, 0})));
  };
  CHECK(with_gap(0.2F) == 1);
  CHECK(with_gap(0.7F) == 2);
}

TEST_CASE("An object has its box, its share of changed voxels and the session that saw it free",
          "[changes]") {
  std::vector<ComparedVoxel> voxels = car({10.0F, -4.0F, 1.0F});
  // A third session saw a smaller part of it free.
  for (std::size_t i = 0; i < 300; ++i) voxels[i].other = 2;
  const auto found = group_changes(voxels, {});
  REQUIRE(found.size() == 1);
  const ChangedObject& object = found[0].object;
  CHECK(object.free_in == 1);
  CHECK(object.voxels == voxels.size());
  CHECK(object.confidence == 1.0);
  CHECK(object.seen_through == 0.0);
  CHECK((object.box.centre - Eigen::Vector3d(11.9, -3.2, 1.6)).norm() < 1e-4);
  CHECK((object.box.size - Eigen::Vector3d(3.8, 1.6, 1.2)).norm() < 1e-4);
}

TEST_CASE("An object takes the unknown voxels beside it and leaves those that did not change",
          "[changes]") {
  // Its lower part hid behind a kerb; a wall behind it still stands.
  const auto low = block({0, 0, -0.4F}, {20, 9, 2}, Presence::kUnknown);
  const auto wall = block({0, 2.0F, 0}, {20, 1, 10}, Presence::kOccupied);
  const auto far = block({0, -3.0F, 0}, {20, 3, 3}, Presence::kUnknown);
  const auto found =
      group_changes(together(together(car({0, 0, 0}), low), together(wall, far)), {});
  REQUIRE(found.size() == 1);
  CHECK(found[0].members.size() == 20 * 9 * 9);
  CHECK(found[0].object.box.size.z() == Approx(1.6).margin(1e-4));
}

TEST_CASE("What changed in too few voxels, or is flat, is no object", "[changes]") {
  MapConfig config;
  const auto small = block({0, 0, 0}, {2, 2, 3}, Presence::kFree);
  config.min_cluster = 12;
  CHECK(objects_in(small, config) == 1);
  config.min_cluster = 13;
  CHECK(objects_in(small, config) == 0);
  config = {};
  config.min_object_height_m = 0.3F;
  CHECK(objects_in(block({0, 0, 0}, {10, 10, 2}, Presence::kFree), config) == 0);
  CHECK(objects_in(block({0, 0, 0}, {10, 10, 3}, Presence::kFree), config) == 1);
}

TEST_CASE("Voxels of small groups are forgotten, those of others are not", "[changes]") {
  MapConfig config;
  config.min_cluster = 12;
  std::vector<ComparedVoxel> voxels = together(block({0, 0, 0}, {2, 2, 3}, Presence::kFree),
                                               block({9.0F, 0, 0}, {11, 1, 1}, Presence::kFree));
  forget_small_groups(voxels, config);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    CHECK(voxels[i].presence == (i < 12 ? Presence::kFree : Presence::kUnknown));
  }
}

TEST_CASE("What is mostly unchanged is no object", "[changes]") {
  // Of ten voxels so many are known to the other session as they are.
  const auto mixed = [](std::size_t unchanged) {
    std::vector<ComparedVoxel> voxels = car({0, 0, 0});
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      if (i % 10 < unchanged) voxels[i].presence = Presence::kOccupied;
    }
    return objects_in(voxels);
  };
  CHECK(mixed(5) == 1);
  CHECK(mixed(6) == 0);
}

TEST_CASE("What its own session saw through, or never observed from within range, is no object",
          "[changes]") {
  REQUIRE(MapConfig::kObjectSeenThrough == 0.22F);
  CHECK(objects_in(car({0, 0, 0}, Presence::kFree, {2, 8})) == 1);
  CHECK(objects_in(car({0, 0, 0}, Presence::kFree, {3, 7})) == 0);
  CHECK(objects_in(car({0, 0, 0}, Presence::kFree, {0, 1})) == 1);
  CHECK(objects_in(car({0, 0, 0}, Presence::kFree, {0, 0})) == 0);
}

TEST_CASE("The box around points is turned as they are", "[changes]") {
  for (const double yaw : {0.0, 0.3, 1.0, 1.5}) {
    INFO("turned by " << yaw);
    const UprightBox truth{{1000.0, -2000.0, 5.0}, yaw, {4.5, 1.8, 1.5}};
    std::vector<Eigen::Vector3f> points;
    for (int x = -10; x <= 10; ++x) {
      for (int y = -4; y <= 4; ++y) {
        const double u = 0.225 * x;
        const double v = 0.225 * y;
        points.emplace_back(static_cast<float>(1000.0 + u * std::cos(yaw) - v * std::sin(yaw)),
                            static_cast<float>(-2000.0 + u * std::sin(yaw) + v * std::cos(yaw)),
                            5.0F + (x % 2 == 0 ? 0.75F : -0.75F));
      }
    }
    const UprightBox box = box_around(points);
    CHECK((box.centre - truth.centre).norm() < 0.05);
    CHECK(std::max(box.size.x(), box.size.y()) == Approx(4.5).margin(0.1));
    CHECK(std::min(box.size.x(), box.size.y()) == Approx(1.8).margin(0.15));
    CHECK(box.size.z() == Approx(1.5).margin(1e-3));
    CHECK(std::all_of(points.begin(), points.end(), [&](const Eigen::Vector3f& point) {
      return box.contains(point.cast<double>(), 1e-3);
    }));
  }
  CHECK(box_around({}).size.norm() == 0.0);
}

TEST_CASE("What is gone and appeared beside it in the other session has moved", "[changes]") {
  const Eigen::Vector3d bench(1.8, 0.6, 0.9);
  std::vector<ChangedObject> objects = {
      object_at(ChangeKind::kAppeared, 0, 1, {50, 0, 0}, {4.5, 1.8, 1.5}),
      object_at(ChangeKind::kGone, 0, 1, {10, 0, 0}, bench),
      object_at(ChangeKind::kAppeared, 1, 0, {11.5, 0, 0}, {0.6, 1.7, 1.0}),
      object_at(ChangeKind::kAppeared, 1, 0, {30, 0, 0}, bench)};
  std::vector<ChangedPoint> points;
  for (std::uint32_t i = 0; i < 4; ++i) points.push_back({{0, 0, 0}, i % 2, i != 1, i});
  pair_moved(objects, points);
  REQUIRE(objects.size() == 3);
  CHECK(objects[0].kind == ChangeKind::kAppeared);
  CHECK(objects[1].kind == ChangeKind::kMoved);
  CHECK(objects[1].session == 1);
  CHECK(objects[1].box.centre.x() == 11.5);
  REQUIRE(objects[1].before.has_value());
  CHECK(objects[1].before->centre.x() == 10.0);
  CHECK(objects[1].voxels == 200);
  CHECK(objects[1].confidence == 0.8);
  CHECK(objects[2].kind == ChangeKind::kAppeared);
  const std::vector<std::uint32_t> expected = {0, 1, 1, 2};
  for (std::size_t i = 0; i < 4; ++i) CHECK(points[i].object == expected[i]);
}

TEST_CASE("What is of another size, farther away or of other sessions has not moved", "[changes]") {
  const Eigen::Vector3d size(4.5, 1.8, 1.5);
  const auto moved = [&](const ChangedObject& appeared) {
    std::vector<ChangedObject> objects = {object_at(ChangeKind::kGone, 0, 1, {0, 0, 0}, size),
                                          appeared};
    std::vector<ChangedPoint> points;
    pair_moved(objects, points);
    return objects.size() == 1;
  };
  CHECK(moved(object_at(ChangeKind::kAppeared, 1, 0, {1.0, 0, 0}, size)));
  CHECK_FALSE(moved(object_at(ChangeKind::kAppeared, 1, 0, {2.5, 0, 0}, size)));
  CHECK_FALSE(moved(object_at(ChangeKind::kAppeared, 1, 0, {1.0, 0, 0}, {4.5, 1.8, 2.4})));
  CHECK_FALSE(moved(object_at(ChangeKind::kAppeared, 2, 0, {1.0, 0, 0}, size)));
  CHECK_FALSE(moved(object_at(ChangeKind::kAppeared, 1, 2, {1.0, 0, 0}, size)));
  CHECK_FALSE(moved(object_at(ChangeKind::kGone, 1, 0, {1.0, 0, 0}, size)));
}
