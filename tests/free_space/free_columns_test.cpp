// Free columns: between the highest ground and the lowest other cell
#include "src/free_space/free_columns.hpp"

#include "tests/test.hpp"
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

TEST_CASE("a column is free from its highest ground cell to the lowest cell above it") {
  struct Case {
    Heights ground;
    Heights others;
    Heights free;
  };
  for (const Case& c : {Case{{-5, -4, -3}, {1}, {-2, -1, 0}}, Case{{-3}, {0, 2, 7}, {-2, -1}},
                        // Cells below the ground are no obstacle; without ground nothing is free.
                        Case{{8}, {-8}, {9, 10, 11, 12}}, Case{{}, {0}, {}}}) {
    Column up;
    for (const std::int32_t z : c.ground) up.add(z, true);
    for (const std::int32_t z : c.others) up.add(z, false);
    CHECK(up.free() == c.free);
    Column down;
    for (auto z = c.others.rbegin(); z != c.others.rend(); ++z) down.add(*z, false);
    for (auto z = c.ground.rbegin(); z != c.ground.rend(); ++z) down.add(*z, true);
    CHECK(down.free() == c.free);
  }
}
