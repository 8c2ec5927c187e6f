// Outline of a connected component
#include "src/free_space/component_outline.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

constexpr float kCellM = 0.2F;

/// The outline of a full box of cells.
Outline outline(const VoxelIndex& size) {
  CellBox box;
  for (std::int32_t z = 0; z < size.z; ++z) {
    for (std::int32_t y = 0; y < size.y; ++y) {
      for (std::int32_t x = 0; x < size.x; ++x) {
        const VoxelIndex cell{x - 7, y - 5, z - 3};
        box.include(block_of(cell), std::uint64_t{1} << bit_of(cell));
      }
    }
  }
  CHECK(box.width() == std::max(size.x, size.y));
  CHECK(box.height() == size.z);
  return outline_of(box, kCellM);
}

}  // namespace

TEST_CASE("two cells wide and a metre high is a pole, lower a fragment", "[outline]") {
  CHECK(outline({2, 1, 5}) == Outline::kPole);
  CHECK(outline({2, 1, 4}) == Outline::kFragment);
}

TEST_CASE("a sign on its pole is slender and higher than a person", "[outline]") {
  CHECK(outline({4, 1, 12}) == Outline::kPole);
  CHECK(outline({4, 1, 9}) == Outline::kWide);
  CHECK(outline({5, 5, 12}) == Outline::kWide);
  CHECK(outline({5, 5, 15}) == Outline::kPole);
}

TEST_CASE("nothing that is wider than a lamp's arm is a pole", "[outline]") {
  CHECK(outline({12, 1, 36}) == Outline::kPole);
  CHECK(outline({13, 1, 60}) == Outline::kWide);
}
