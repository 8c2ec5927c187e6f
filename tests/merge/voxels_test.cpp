// Voxels that keyframes occupy, those of a session by tiles, and sums around them
#include "src/merge/labels/occupied_voxels.hpp"
#include "src/merge/labels/voxel_blocks.hpp"
#include "src/merge/map/intensity_scale.hpp"
#include "src/merge/map/map_regions.hpp"
#include "src/merge/map/session_voxels.hpp"
#include "src/merge/map/unified_map.hpp"
#include "tests/merge/random.hpp"
#include "tests/random.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Random;

namespace {

constexpr float kSize_m = 0.2F;

KeyframeRecord scattered(Random& random, int cells) {
  KeyframeRecord keyframe;
  for (int i = 0; i < cells; ++i) {
    const auto at = [&] { return static_cast<float>(random.uniform(-2.0, 2.0)); };
    const Eigen::Vector3f position(at(), at(), at());
    (i % 3 == 0 ? keyframe.dynamic_cells : keyframe.static_cells).push_back({position, 3, 0, 0});
  }
  return keyframe;
}

std::set<VoxelKey> voxels_of(const KeyframeRecord& keyframe, const Pose& T_map_keyframe) {
  std::set<VoxelKey> voxels;
  for (const auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
    for (const FineCell& cell : *cells) {
      voxels.insert(*observed_voxel(T_map_keyframe * cell.position.cast<double>(), kSize_m));
    }
  }
  return voxels;
}

}  // namespace

TEST_CASE("Voxels are counted once for every keyframe that occupies them", "[refinement]") {
  Random random(5);
  Pose T_map_keyframe;
  T_map_keyframe.translation = {-3.1, 1.7, 0.4};
  const KeyframeRecord own = scattered(random, 3000);
  const OccupiedBlocks of(own, T_map_keyframe, kSize_m);
  OccupationCounts counts(of);
  std::vector<std::set<VoxelKey>> others;
  for (int k = 0; k < 20; ++k) {
    const KeyframeRecord other = scattered(random, 3000);
    counts.add(OccupiedBlocks(other, T_map_keyframe, kSize_m));
    others.push_back(voxels_of(other, T_map_keyframe));
  }
  for (const VoxelKey voxel : voxels_of(own, T_map_keyframe)) {
    std::int32_t expected = 0;
    for (const auto& other : others) expected += other.count(voxel) != 0 ? 1 : 0;
    CHECK(counts.at(voxel) == expected);
  }
  CHECK(counts.at(pack({500, 500, 500})) == 0);
}

TEST_CASE("As many keyframes are counted as a configuration may ask for", "[refinement]") {
  KeyframeRecord keyframe;
  keyframe.static_cells.push_back({{0.1F, 0.1F, 0.1F}, 3, 0, 0});
  const OccupiedBlocks blocks(keyframe, Pose{}, kSize_m);
  OccupationCounts counts(blocks);
  for (int k = 0; k < 2000; ++k) counts.add(blocks);
  CHECK(counts.at(pack({0, 0, 0})) == 2000);
}

TEST_CASE("Cells too far away for a voxel occupy none", "[refinement]") {
  KeyframeRecord keyframe;
  keyframe.static_cells.push_back({{1e9F, 0.0F, 0.0F}, 3, 0, 0});
  keyframe.static_cells.push_back({{std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F}, 3, 0, 0});
  CHECK(OccupiedBlocks(keyframe, Pose{}, kSize_m).blocks().empty());
}

namespace {

/// Voxels around the origin, without repetition, each with a value.
struct Cloud {
  std::vector<VoxelKey> voxels;
  std::vector<SurroundingSum> value;  ///< by row

  explicit Cloud(std::uint32_t seed) {
    Random random(seed);
    std::set<VoxelKey> once;
    const auto at = [&] { return static_cast<std::int32_t>(random.uniform(-9.0, 9.0)); };
    for (int i = 0; i < 900; ++i) once.insert(pack({at(), at(), at()}));
    voxels.assign(once.begin(), once.end());
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      value.push_back({static_cast<std::int64_t>(random.uniform(-5e9, 5e9)),
                       static_cast<std::uint32_t>(1 + i % 3)});
    }
  }
};

/// Over all voxels at most two away along every axis, except those left out.
SurroundingSum slow_sum(const Cloud& cloud, const VoxelBlocks& blocks, std::size_t of,
                        const std::vector<bool>& left_out) {
  const VoxelIndex middle = unpack(cloud.voxels[of]);
  SurroundingSum sum;
  for (std::size_t i = 0; i < cloud.voxels.size(); ++i) {
    const VoxelIndex other = unpack(cloud.voxels[i]);
    if (std::abs(other.x - middle.x) > 2 || std::abs(other.y - middle.y) > 2) continue;
    if (std::abs(other.z - middle.z) > 2 || left_out[i]) continue;
    sum.log_odds += cloud.value[blocks.row_of_voxel(i)].log_odds;
    sum.cells += cloud.value[blocks.row_of_voxel(i)].cells;
  }
  return sum;
}

}  // namespace

TEST_CASE("A sum has every voxel at most two away and no other", "[refinement]") {
  const bool leaves_out = GENERATE(false, true);
  const Cloud cloud(7);
  const VoxelBlocks blocks(cloud.voxels);
  std::vector<bool> is_left_out(cloud.voxels.size(), false);
  std::vector<std::uint64_t> left_out(blocks.blocks().size(), 0);
  std::vector<std::size_t> voxel_at_row(cloud.voxels.size());
  for (std::size_t i = 0; i < cloud.voxels.size(); ++i) {
    voxel_at_row[blocks.row_of_voxel(i)] = i;
    const VoxelIndex voxel = unpack(cloud.voxels[i]);
    if (!leaves_out || voxel.z > -3) continue;
    is_left_out[i] = true;
    for (std::size_t b = 0; b < left_out.size(); ++b) {
      if (blocks.blocks()[b].index == block_of(voxel)) {
        left_out[b] |= std::uint64_t{1} << bit_of(voxel);
      }
    }
  }
  SurroundingSums sums(blocks, cloud.value, leaves_out ? &left_out : nullptr);
  std::size_t visited = 0;
  for (std::uint32_t b = 0; b < blocks.blocks().size(); ++b) {
    sums.visit(b, [&](std::uint32_t row, const SurroundingSum& sum) {
      const std::size_t voxel = voxel_at_row[row];
      const SurroundingSum expected = slow_sum(cloud, blocks, voxel, is_left_out);
      CHECK(sum.log_odds == expected.log_odds);
      CHECK(sum.cells == expected.cells);
      CHECK_FALSE(is_left_out[voxel]);
      ++visited;
    });
  }
  std::size_t expected = 0;
  for (const bool out : is_left_out) expected += out ? 0 : 1;
  CHECK(visited == expected);
}

TEST_CASE("A block knows whether anything that is left out is in its reach", "[refinement]") {
  // Along x, from the block of 0 to 3: the voxels 4 and 5 are in reach, 6 is not.
  for (const std::int32_t x : {4, 5, 6, -1, -2, -3}) {
    INFO("voxel " << x);
    const std::vector<VoxelKey> voxels{pack({1, 1, 1}), pack({x, 1, 1})};
    const VoxelBlocks blocks(voxels);
    const std::vector<SurroundingSum> value(2);
    const std::vector<std::uint64_t> left_out{0, ~std::uint64_t{0} & blocks.blocks()[1].occupied};
    const SurroundingSums sums(blocks, value, &left_out);
    CHECK(sums.leaves_out_near(0) == (x >= -2 && x <= 5));
  }
}

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
      voxels.add(voxel, Eigen::Vector3f::Constant(within),
                 {Eigen::Vector3f::Zero(), 1, static_cast<std::uint8_t>(i % 5 == 0),
                  static_cast<std::uint8_t>(random.below(256))});
    }
  }
  voxels.finish();
}

using Seen = std::vector<std::pair<VoxelKey, SessionVoxels::Voxel>>;

Seen all(const SessionVoxels& voxels) {
  Seen seen;
  voxels.visit([&](VoxelKey key, const auto& voxel) { seen.emplace_back(key, voxel); });
  return seen;
}

bool are_same(const Seen& a, const Seen& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
    return p.first == q.first && p.second.sum == q.second.sum && p.second.cells == q.second.cells &&
           p.second.ground == q.second.ground &&
           p.second.intensity.mean() == q.second.intensity.mean();
  });
}

}  // namespace

TEST_CASE("Voxels in a file are to the bit those that were in memory, however few stay there",
          "[voxels]") {
  SessionVoxels here(0.2F);
  drive(here, 9);
  const Seen expected = all(here);
  REQUIRE(expected.size() > 10'000);
  CHECK(here.size() == expected.size());
  const TemporaryDirectory folder;
  const auto file = std::make_shared<ScratchFile>(folder.path());
  for (const std::size_t most :
       {std::size_t{10}, std::size_t{5'000}, SessionVoxels::kMostInMemory}) {
    SessionVoxels there(0.2F, file, most);
    drive(there, 9);
    CHECK(there.size() == here.size());
    CHECK(are_same(all(there), expected));
    CHECK(there.sizes() == here.sizes());
  }
}

TEST_CASE("A point of the map has the mean intensity of the cells that have one", "[voxels]") {
  const auto session_of = [](std::initializer_list<std::uint8_t> intensities) {
    SessionVoxels voxels(0.2F);
    for (const std::uint8_t intensity : intensities) {
      voxels.add({1, 2, 3}, Eigen::Vector3f::Zero(), {Eigen::Vector3f::Zero(), 1, 0, intensity});
    }
    return voxels;
  };
  const SessionVoxels first = session_of({10, 0, 20});
  const SessionVoxels second = session_of({60});
  const SessionVoxels third = session_of({0});
  CHECK((*unite({&first, &second, &third}).begin()).intensity == 30);
  CHECK((*unite({&third}).begin()).intensity == 0);
}

TEST_CASE("Intensities of sessions on another scale are brought to the highest one", "[voxels]") {
  const auto session_of = [](std::int32_t from, std::int32_t voxels, double scale) {
    SessionVoxels session(0.2F);
    for (std::int32_t i = from; i < from + voxels; ++i) {
      const auto intensity = static_cast<std::uint8_t>(scale * (40 + i % 61));
      session.add({i, 2, 3}, Eigen::Vector3f::Zero(), {Eigen::Vector3f::Zero(), 1, 0, intensity});
    }
    return session;
  };
  const SessionVoxels high = session_of(0, 1000, 2.4);
  const SessionVoxels alike = session_of(0, 1000, 1.3);
  const SessionVoxels low = session_of(500, 1000, 0.15);
  const SessionVoxels beyond_low = session_of(1250, 1000, 0.3);
  const SessionVoxels apart = session_of(5000, 1000, 0.3);
  const SessionVoxels bare = session_of(0, 1000, 0.0);
  const std::vector<float> factors =
      intensity_factors({&high, &bare, &alike, &low, nullptr, &beyond_low, &apart});
  CHECK(factors[0] == 1.0F);
  CHECK(factors[1] == 1.0F);
  CHECK(factors[2] == 1.0F);
  CHECK(factors[3] == Approx(2.4F / 0.15F).epsilon(0.1));
  CHECK(factors[5] == Approx(2.4F / 0.3F).epsilon(0.15));
  CHECK(factors[6] == 1.0F);
  CHECK(intensity_factors({&low, &high})[0] == Approx(2.4F / 0.15F).epsilon(0.1));
  CHECK(intensity_factors({&low})[0] == 1.0F);
  const SessionVoxels few = session_of(0, 199, 0.3);
  CHECK(intensity_factors({&high, &few})[1] == 1.0F);

  // A session that joins two groups later, in whatever order they come.
  const SessionVoxels bridge = session_of(750, 1000, 2.4);
  const SessionVoxels far_low = session_of(1500, 1000, 0.3);
  for (const auto& [order, lower] : std::vector<std::pair<std::vector<const SessionVoxels*>, int>>{
           {{&high, &far_low, &bridge}, 1}, {{&bridge, &high, &far_low}, 2}}) {
    CHECK(intensity_factors(order)[static_cast<std::size_t>(lower)] ==
          Approx(2.4F / 0.3F).epsilon(0.15));
  }
  // A driver that fills the field with its end tells nothing.
  SessionVoxels filled(0.2F);
  for (std::int32_t i = 500; i < 1500; ++i) {
    filled.add({i, 2, 3}, Eigen::Vector3f::Zero(), {Eigen::Vector3f::Zero(), 1, 0, 255});
  }
  CHECK(intensity_factors({&low, &filled})[0] == 1.0F);

  const auto map = unite({&high, &low}, nullptr, factors);
  CHECK((*map.begin()).intensity == 96);
  const auto of_low = unite({&low}, nullptr, {40.0F});
  CHECK((*of_low.begin()).intensity == 255);
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
