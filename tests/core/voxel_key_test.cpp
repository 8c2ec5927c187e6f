// Tests of voxel keys.
#include "src/core/voxel_key.hpp"

#include "tests/test.hpp"

using namespace unimapper;

TEST_CASE("packing and unpacking are inverse up to the axis limit") {
  const std::int32_t values[] = {-kVoxelAxisLimit, -1000, -1, 0, 1, 77, kVoxelAxisLimit - 1};
  for (const std::int32_t x : values) {
    for (const std::int32_t y : values) {
      for (const std::int32_t z : values) {
        const VoxelIndex index{x, y, z};
        REQUIRE(is_representable(index));
        REQUIRE(unpack(pack(index)) == index);
      }
    }
  }
  CHECK_FALSE(is_representable({kVoxelAxisLimit, 0, 0}));
  CHECK_FALSE(is_representable({0, -kVoxelAxisLimit - 1, 0}));
  CHECK_FALSE(is_representable({0, 0, std::numeric_limits<std::int32_t>::max()}));
}

// Keyframes and hash tables travel between machines and outlive releases: a change of these
// values changes the order of cells, keypoints and loops everywhere.
TEST_CASE("keys and hashes are pinned") {
  CHECK(pack({0, 0, 0}) == 0x4000020000100000ULL);
  CHECK(pack({1, -2, 3}) == 0x40000DFFFFD00001ULL);
  CHECK(mix_bits(0) == 0);
  CHECK(mix_bits(1) == 0x3C0AAD46F555E0B9ULL);
  CHECK(mix_bits(0xDEADBEEFULL) == 0xC18CA95DE092D125ULL);
  CHECK(mix_bits(~0ULL) == 0x9055D46B73492210ULL);
}

TEST_CASE("flooring rounds towards minus infinity") {
  for (const float value : {-2.0F, -1.5F, -1.0F, -0.001F, -0.0F, 0.0F, 0.001F, 0.999F, 1.0F, 1e6F,
                            -1e6F, -1e6F - 0.5F}) {
    CHECK(floor_to_int(value) == static_cast<std::int32_t>(std::floor(value)));
  }
}

TEST_CASE("a point lies in the cell whose lower corner is not above it") {
  const VoxelIndex index = voxel_index({-0.01F, 0.39F, 0.41F}, 5.0F);
  CHECK(index == VoxelIndex{-1, 1, 2});
}

TEST_CASE("one changed bit changes about half of the hash") {
  double changed = 0.0;
  int samples = 0;
  for (std::uint64_t key = 0; key < 200; ++key) {
    for (unsigned bit = 0; bit < 63; bit += 3) {
      std::uint64_t difference = mix_bits(key * 7919) ^ mix_bits((key * 7919) ^ (1ULL << bit));
      for (; difference != 0; difference &= difference - 1) changed += 1.0;
      ++samples;
    }
  }
  CHECK(changed / samples == Approx(32.0).margin(1.0));
}
