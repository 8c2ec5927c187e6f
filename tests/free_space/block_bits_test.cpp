// Morphology of blocks against plain loops
#include "src/free_space/block_bits.hpp"

#include <bit>

#include "src/core/voxel_key.hpp"
#include "src/free_space/block.hpp"
#include "tests/test.hpp"

using namespace unimapper;

namespace {

bool touch(const VoxelIndex& a, const VoxelIndex& b) {
  return std::abs(a.x - b.x) <= 1 && std::abs(a.y - b.y) <= 1 && std::abs(a.z - b.z) <= 1;
}

VoxelIndex cell_number(unsigned bit) {
  return {static_cast<std::int32_t>(bit & 3U), static_cast<std::int32_t>(bit >> 2U & 3U),
          static_cast<std::int32_t>(bit >> 4U)};
}

/// Cells of the block at an offset that touch any of `cells`.
std::uint64_t touched_slowly(std::uint64_t cells, int x, int y, int z) {
  std::uint64_t result = 0;
  for (unsigned a = 0; a < 64; ++a) {
    if ((cells >> a & 1U) == 0) continue;
    for (unsigned b = 0; b < 64; ++b) {
      VoxelIndex there = cell_number(b);
      there = {there.x + 4 * x, there.y + 4 * y, there.z + 4 * z};
      if (touch(cell_number(a), there)) result |= std::uint64_t{1} << b;
    }
  }
  return result;
}

/// Sparse, dense and everything between.
std::uint64_t sample(std::uint64_t i) {
  const std::uint64_t word = mix_bits(i * 3 + 1);
  return i % 3 == 0 ? word : i % 3 == 1 ? word & mix_bits(i + 77) & mix_bits(i + 99) : word | 1U;
}

}  // namespace

TEST_CASE("bits and cells name the same thing") {
  for (unsigned bit = 0; bit < 64; ++bit) CHECK(bit_of(cell_number(bit)) == bit);
  CHECK(bit_of({-1, -4, 7}) == bit_of({3, 0, 3}));
  CHECK(block_of({-1, -4, 7}) == VoxelIndex{-1, -1, 1});
}

TEST_CASE("cells touch those beside them in their own layer alone") {
  for (std::uint64_t i = 0; i < 60; ++i) {
    const std::uint64_t cells = sample(i);
    for (int n = 0; n < 9; ++n) {
      std::uint64_t expected = 0;
      for (unsigned z = 0; z < 4; ++z) {
        const std::uint64_t layer = std::uint64_t{0xFFFF} << 16 * z;
        expected |= touched_slowly(cells & layer, n % 3 - 1, n / 3 - 1, 0) & layer;
      }
      CHECK(touched_beside(cells, n % 3 - 1, n / 3 - 1) == expected);
    }
  }
}

TEST_CASE("cells touch their neighbours within the block and in all 26 around it") {
  for (std::uint64_t i = 0; i < 60; ++i) {
    const std::uint64_t cells = i < 3 ? i : sample(i);
    CHECK(dilated(cells) == touched_slowly(cells, 0, 0, 0));
    for (int n = 0; n < 27; ++n) {
      const int x = n % 3 - 1;
      const int y = n / 3 % 3 - 1;
      const int z = n / 9 - 1;
      if (n == 13) continue;
      CHECK(touched_in_neighbour(cells, x, y, z) == touched_slowly(cells, x, y, z));
    }
  }
}

TEST_CASE("a flood fills exactly what is connected") {
  // A path that winds through the block and ends next to an island.
  std::uint64_t path = 0;
  for (const VoxelIndex& cell : {VoxelIndex{0, 0, 0}, {1, 1, 0}, {2, 2, 1}, {3, 1, 2}, {3, 0, 3}}) {
    path |= std::uint64_t{1} << bit_of(cell);
  }
  const std::uint64_t island = std::uint64_t{1} << bit_of({0, 3, 3});
  CHECK(flooded(1, path | island) == path);
  CHECK(flooded(island, path | island) == island);
  CHECK(flooded(1, ~std::uint64_t{0}) == ~std::uint64_t{0});
  CHECK(flooded(1, 1) == 1);
}

TEST_CASE("layers from a number on hold exactly the cells at or beyond it") {
  for (std::int32_t first = 0; first < 8; ++first) {
    for (unsigned bit = 0; bit < 64; ++bit) {
      const VoxelIndex cell = cell_number(bit);
      CHECK((layers_from_x(first) >> bit & 1U) == (cell.x >= first ? 1U : 0U));
      CHECK((layers_from_y(first) >> bit & 1U) == (cell.y >= first ? 1U : 0U));
      CHECK((layers_from_z(first) >> bit & 1U) == (cell.z >= first ? 1U : 0U));
    }
  }
}

TEST_CASE("some cells of a block are visited with their rows, lowest bit first") {
  for (std::uint64_t i = 0; i < 60; ++i) {
    const std::uint64_t occupied = sample(i);
    const Block block{occupied, {}, 100};
    for (const std::uint64_t some : {occupied, occupied & sample(i + 1), std::uint64_t{0}}) {
      std::uint64_t left = some;
      visit_rows(block, some, [&](std::uint64_t cell, std::uint32_t row) {
        CHECK(cell == lowest_bit(left));
        CHECK(row == row_of(block, static_cast<std::uint32_t>(std::countr_zero(cell))));
        left &= left - 1;
      });
      CHECK(left == 0);
    }
  }
}
