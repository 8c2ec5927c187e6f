// Tests of a session's voxels by tiles, and of regions of a map
#include "src/merge/session_voxels.hpp"

#include <catch2/catch.hpp>
#include <memory>
#include <set>
#include <vector>

#include "src/merge/map_regions.hpp"
#include "tests/random.hpp"
#include "tests/temporary_directory.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// A drive over so many tiles and back: voxels beside a line, each seen several times.
void drive(SessionVoxels& voxels, std::int32_t tiles) {
  test::Random random(5);
  const std::int32_t length = tiles * kTileVoxels;
  for (std::int32_t step = 0; step < 2 * length; step += 4) {
    const std::int32_t x = step < length ? step : 2 * length - step;
    for (int i = 0; i < 20; ++i) {
      const VoxelIndex voxel{x + static_cast<std::int32_t>(8.0 * random.uniform()) - 100,
                             static_cast<std::int32_t>(40.0 * random.uniform()) - 20, i % 5};
      const auto within = static_cast<float>(0.2 * random.uniform());
      voxels.add(voxel, Eigen::Vector3f::Constant(within), i % 5 == 0);
    }
  }
  voxels.finish();
}

struct Seen {
  VoxelKey key;
  SessionVoxels::Voxel voxel;
  friend bool operator==(const Seen& a, const Seen& b) {
    return a.key == b.key && a.voxel.sum == b.voxel.sum && a.voxel.cells == b.voxel.cells &&
           a.voxel.ground == b.voxel.ground;
  }
};

std::vector<Seen> all(const SessionVoxels& voxels) {
  std::vector<Seen> seen;
  voxels.visit([&](VoxelKey key, const SessionVoxels::Voxel& voxel) {
    seen.push_back({key, voxel});
  });
  return seen;
}

}  // namespace

TEST_CASE("Voxels in a file are to the bit those that were in memory, however few stay there",
          "[voxels]") {
  SessionVoxels here(0.2F);
  drive(here, 9);
  const std::vector<Seen> expected = all(here);
  REQUIRE(expected.size() > 10'000);
  CHECK(here.size() == expected.size());
  const TemporaryDirectory folder;
  const auto file = std::make_shared<ScratchFile>(folder.path());
  for (const std::size_t most :
       {std::size_t{10}, std::size_t{5'000}, SessionVoxels::kMostInMemory}) {
    SessionVoxels there(0.2F, file, most);
    drive(there, 9);
    CHECK(there.size() == here.size());
    CHECK(all(there) == expected);
    CHECK(there.sizes() == here.sizes());
  }
}

TEST_CASE("A tile has its own voxels, and every voxel is in one", "[voxels]") {
  SessionVoxels voxels(0.2F);
  drive(voxels, 3);
  std::size_t sum = 0;
  for (const auto& [of_tile, size] : voxels.sizes()) {
    const auto tile = of_tile;  // Clang captures no structured binding
    std::size_t count = 0;
    voxels.visit(tile, [&](VoxelKey key, const auto&) {
      CHECK(tile_of(unpack(key)) == tile);
      ++count;
    });
    CHECK(count == size);
    sum += count;
  }
  CHECK(sum == voxels.size());
  CHECK(tile_of({-1, 0, 3}) == MapTile{0, -1});
  CHECK(tile_of({255, 256, -9}) == MapTile{1, 0});
}

TEST_CASE("Regions cover the plane once, each with few voxels, and one is enough for a small map",
          "[voxels]") {
  SessionVoxels drive_of_nine(0.2F);
  drive(drive_of_nine, 9);
  const std::vector<const SessionVoxels*> sessions{&drive_of_nine, nullptr, &drive_of_nine};
  CHECK(map_regions(sessions, 2 * drive_of_nine.size()).size() == 1);
  CHECK(map_regions({nullptr}, 10).size() == 1);
  const std::size_t most = drive_of_nine.size() / 2;
  const std::vector<TileBox> regions = map_regions(sessions, most);
  CHECK(regions.size() > 3);
  for (std::int32_t x = -20; x < 30; ++x) {
    for (std::int32_t y = -20; y < 20; ++y) {
      const MapTile tile{y, x};
      CHECK(std::count_if(regions.begin(), regions.end(),
                          [&](const TileBox& region) { return region.contains(tile); }) == 1);
    }
  }
  const auto sizes = drive_of_nine.sizes();
  for (const TileBox& region : regions) {
    std::size_t voxels = 0;
    std::size_t tiles = 0;
    for (const auto& [tile, size] : sizes) {
      if (!region.contains(tile)) continue;
      voxels += 2 * size;
      ++tiles;
    }
    CHECK((voxels <= most || tiles == 1));
  }
}
