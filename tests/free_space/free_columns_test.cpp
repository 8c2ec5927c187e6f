// Free columns: between the highest ground and the lowest other cell
#include "unimapper/free_space/free_columns.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "unimapper/core/owned.hpp"

using namespace unimapper;

namespace {

/// Occupied cells of the column x = 1, y = 2 by their heights, of which some are ground.
struct Column {
  std::vector<Block> blocks;
  std::vector<std::uint64_t> ground;

  void add(std::int32_t z, bool is_ground) {
    const VoxelIndex cell{1, 2, z};
    std::size_t b = 0;
    while (b < blocks.size() && !(blocks[b].index == block_of(cell))) ++b;
    if (b == blocks.size()) {
      blocks.push_back({0, block_of(cell), 0});
      ground.push_back(0);
    }
    const std::uint64_t bit = std::uint64_t{1} << bit_of(cell);
    blocks[b].occupied |= bit;
    if (is_ground) ground[b] |= bit;
  }
  /// Heights from -12 to 12 that are free.
  [[nodiscard]] std::vector<std::int32_t> free() const {
    Owned<FreeColumns> columns(std::size_t{16});
    columns->build(blocks, [this](std::uint32_t b) { return ground[b]; });
    std::vector<std::int32_t> heights;
    for (std::int32_t z = -12; z <= 12; ++z) {
      if (columns->is_free({1, 2, z})) heights.push_back(z);
      CHECK_FALSE(columns->is_free({2, 2, z}));
    }
    return heights;
  }
};

using Heights = std::vector<std::int32_t>;

}  // namespace

TEST_CASE("a column is free above its highest ground cell, in whatever order they come") {
  Column up;
  for (const std::int32_t z : {-5, -4, -3}) up.add(z, true);
  up.add(1, false);
  CHECK(up.free() == Heights{-2, -1, 0});
  Column down;
  down.add(1, false);
  for (const std::int32_t z : {-3, -4, -5}) down.add(z, true);
  CHECK(down.free() == Heights{-2, -1, 0});
}

TEST_CASE("a column is free below its lowest cell above the ground, in whatever order they come") {
  Column up;
  up.add(-3, true);
  for (const std::int32_t z : {0, 2, 7}) up.add(z, false);
  CHECK(up.free() == Heights{-2, -1});
  Column down;
  for (const std::int32_t z : {7, 2, 0}) down.add(z, false);
  down.add(-3, true);
  CHECK(down.free() == Heights{-2, -1});
}

TEST_CASE("cells below the ground are no obstacle, and without ground nothing is free") {
  Column below;
  below.add(-8, false);
  below.add(8, true);
  CHECK(below.free() == Heights{9, 10, 11, 12});
  Column none;
  none.add(0, false);
  CHECK(none.free().empty());
}
