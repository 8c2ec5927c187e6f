// Tests of the odometry's local map.
#include "src/odometry/local_map.hpp"

#include <catch2/catch.hpp>

#include "tests/random.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::odometry;

namespace {

/// Voxels of a metre.
struct OwnedMap : Owned<LocalMap> {
  explicit OwnedMap(std::size_t voxels = 64) : Owned<LocalMap>(voxels, 1.0, 0.24) {}
};

std::uint32_t nearest_surface(LocalMap& map, const Eigen::Vector3d& point) {
  LocalMap::Neighbourhood neighbourhood;
  map.find_nearest(point, neighbourhood);
  return neighbourhood.entry;
}

/// The surface nearest to a point, which there must be.
const Surface& surface_at(OwnedMap& map, const Eigen::Vector3d& point) {
  const std::uint32_t entry = nearest_surface(*map, point);
  REQUIRE(entry != LocalMap::kNone);
  return map->voxel(entry).surface;
}

}  // namespace

TEST_CASE("a full plane is a clear surface that says how far points are across it") {
  OwnedMap map;
  for (double x = 0.05; x < 1.0; x += 0.1) {
    for (double y = 0.05; y < 1.0; y += 0.1) map->add({x, y, 0.5});
  }
  const Surface& surface = surface_at(map, {0.4, 0.6, 0.7});
  CHECK(surface.is_clear);
  CHECK(surface.across[5] == Approx(1.0F));  // z with z
  CHECK(surface.across[0] == Approx(0.0F).margin(1e-5));
  CHECK(surface.mean_m.z() == Approx(0.0F).margin(1e-6));
}

TEST_CASE("a line that lies is no surface, and one that stands is a pole") {
  OwnedMap map;
  for (double a = 0.01; a < 4.0; a += 0.05) map->add({a, 0.5, 0.5});
  CHECK(nearest_surface(*map, {0.5, 0.5, 0.5}) == LocalMap::kNone);
  map->clear();
  for (double a = 0.01; a < 4.0; a += 0.01) {
    map->add({0.49, 0.49, a});
    map->add({0.51, 0.51, a});
    map->add({0.51, 0.49, a});
  }
  const Surface& pole = surface_at(map, {0.6, 0.5, 0.5});
  CHECK(pole.across[0] == Approx(1.0F).margin(0.01));
  CHECK(pole.across[3] == Approx(1.0F).margin(0.01));
  CHECK(pole.across[5] == Approx(0.0F).margin(0.01));
}

TEST_CASE("what is scattered, and what has few points, is no surface") {
  OwnedMap map;
  test::Random random(1);
  for (int i = 0; i < 500; ++i) {
    map->add({random.uniform(), random.uniform(), random.uniform()});
  }
  CHECK(nearest_surface(*map, {0.5, 0.5, 0.5}) == LocalMap::kNone);
  map->clear();
  for (int i = 0; i < 6; ++i) map->add({0.1 + 0.12 * i, 0.1 + 0.1 * (i % 3), 0.5});
  CHECK(nearest_surface(*map, {0.5, 0.5, 0.5}) == LocalMap::kNone);
}

TEST_CASE("points in a heap are a surface along the directions in which it is compact") {
  OwnedMap map;
  test::Random random(1);
  const auto fill = [&](double height) {
    map->clear();
    for (int i = 0; i < 2000; ++i) {
      map->add({random.uniform(0.2, 0.8), random.uniform(0.2, 0.8),
                random.uniform(0.5 - 0.5 * height, 0.5 + 0.5 * height)});
    }
    return surface_at(map, {0.5, 0.5, 0.5});
  };
  const Surface heap = fill(0.6);
  CHECK(heap.is_cluster);
  CHECK(heap.is_clear);
  for (const int diagonal : {0, 3, 5}) {
    CHECK(heap.across[diagonal] > 0.02F);  // less than a plane, which has one
    CHECK(heap.across[diagonal] < 0.2F);
  }
  const Surface column = fill(1.0);
  CHECK(column.across[0] > 0.02F);
  CHECK(column.across[5] == Approx(0.0F).margin(0.005));
}

TEST_CASE("a place that is seen again stays as it is") {
  OwnedMap map;
  test::Random random(2);
  const auto look = [&] {
    for (double x = 0.1; x < 1.0; x += 0.2) {
      for (double y = 0.1; y < 1.0; y += 0.2) map->add({x, y, 0.4 + random.uniform(-0.02, 0.02)});
    }
  };
  look();
  const Eigen::Vector3f mean_m = surface_at(map, {0.5, 0.5, 0.5}).mean_m;
  for (int i = 0; i < 50; ++i) look();
  CHECK(surface_at(map, {0.5, 0.5, 0.5}).mean_m == mean_m);
}

TEST_CASE("what is far is forgotten within some calls, and what is near is kept") {
  OwnedMap map(4096);
  for (int x = 0; x < 100; ++x) {
    for (int y = 0; y < 10; ++y) map->add({x + 0.5, y + 0.5, 0.5});
  }
  CHECK(map->size() == 1000);
  for (int i = 0; i < 50; ++i) map->forget_far({0.0, 0.0, 0.0}, 30.0);
  CHECK(map->size() < 310);
  CHECK(map->size() > 250);
  for (std::uint32_t i = 0; i < map->size(); ++i) CHECK(map->centre(i).norm() <= 30.0);
}

TEST_CASE("a map that is full refuses further voxels, and takes points of those it has") {
  OwnedMap map(2);
  CHECK(map->add({0.5, 0.5, 0.5}));
  CHECK(map->add({1.5, 0.5, 0.5}));
  CHECK_FALSE(map->add({2.5, 0.5, 0.5}));
  CHECK(map->add({0.9, 0.9, 0.9}));
}

TEST_CASE("points beyond all bounds are no undefined behaviour") {
  OwnedMap map(8);
  CHECK(map->add({1e300, -1e300, 0.0}));
  CHECK(nearest_surface(*map, {1e300, 0.0, -1e300}) == LocalMap::kNone);
}
