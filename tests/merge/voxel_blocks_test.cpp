// Tests of sums around voxels.
#include "src/merge/voxel_blocks.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <set>

#include "tests/merge/random.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Random;

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
