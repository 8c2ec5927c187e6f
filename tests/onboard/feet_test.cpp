// Feet: ground cells below dynamic ones, and the level above which their points are dynamic
#include "src/onboard/removal/feet.hpp"

#include "stages.hpp"
#include "tests/test.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

namespace {

/// Where a walker stands, and a cell of his leg.
const Eigen::Vector3f kFoot(1.05F, 1.05F, 0.1F);
const Eigen::Vector3f kLeg(1.05F, 1.05F, 0.3F);

/// How high above the grid's origin feet begin at `foot`, metres; nothing if its cell is not asked
/// about.
std::optional<float> feet_begin_at(Stages& stages, const Eigen::Vector3f& foot) {
  Feet feet;
  const MemoryBlock memory = lay_out([&](Arena& arena) { feet.allocate(arena, stages.config); });
  feet.find(stages.window.blocks(), stages.cells);
  const std::uint32_t row = stages.row_at(foot);
  const std::uint32_t block = stages.cells.block_of_row(row);
  const std::uint64_t cells = feet.cells_of(block, stages.cells.marks(block));
  if ((cells >> stages.cells.bit_of_row(row) & 1U) == 0) return std::nullopt;
  const std::uint32_t level =
      feet.level_in_cell(stages.window.blocks(), stages.voxels, stages.cells, row);
  return (static_cast<float>(stages.cells.index(row).z) + static_cast<float>(level) / 256.0F) *
         0.2F;
}

/// Splits the ground of `points` and labels the leg dynamic.
void stand_on(Stages& stages, Cloud points, const Eigen::Vector3f& leg = kLeg) {
  points.push_back(leg);
  REQUIRE(stages.take(points) >= 1);
  stages.cells.set(stages.row_at(leg), &CellMarks::dynamic);
}

/// How high feet begin on `ground`, below the walker.
float begin_on(const Cloud& ground) {
  Stages stages;
  stand_on(stages, ground);
  const std::optional<float> begin = feet_begin_at(stages, kFoot);
  REQUIRE(begin);
  return *begin;
}

}  // namespace

TEST_CASE("feet begin above the level of the ground around, not above what they raise themselves") {
  Cloud points = Cloud().floor(0.0F, 2.0F, 0.0F, 2.0F, 0.1F);
  CHECK(begin_on(points) == Approx(0.1F + EvidenceDefaults::kFootHeightM).margin(0.006));
  // With the points of a shoe.
  for (const float z : {0.12F, 0.14F, 0.16F, 0.18F}) points.emplace_back(1.05F, 1.05F, z);
  CHECK(begin_on(points) == Approx(0.1F + EvidenceDefaults::kFootHeightM).margin(0.006));
}

TEST_CASE("neither a slope nor the upper side of a low kerb raises feet") {
  const Cloud slope = Cloud().floor(0.0F, 2.0F, 0.0F, 2.0F, -0.11F, 0.2F);
  CHECK(begin_on(slope) == Approx(0.1F + EvidenceDefaults::kFootHeightM).margin(0.012));
  const Cloud kerb =
      Cloud().floor(0.0F, 1.0F, 0.0F, 2.0F, 0.07F).floor(1.0F, 2.0F, 0.0F, 2.0F, 0.12F);
  CHECK(begin_on(kerb) > 0.12F);
}

TEST_CASE("only ground below or beside what is dynamic holds feet") {
  Stages stages;
  stand_on(stages, Cloud().floor(0.0F, 2.0F, 0.0F, 2.0F, 0.1F));
  CHECK(feet_begin_at(stages, {1.25F, 0.85F, 0.1F}));
  CHECK_FALSE(feet_begin_at(stages, {1.45F, 1.05F, 0.1F}));
  stages.config.ground.foot_height_m = 0.0F;
  CHECK_FALSE(feet_begin_at(stages, kFoot));
}

TEST_CASE("cells in other blocks hold feet, too") {
  // The leg is the lowest cell of a block, and at its edge.
  Stages stages;
  stand_on(stages, Cloud().floor(0.0F, 1.6F, 0.0F, 1.6F, 0.7F), {0.85F, 0.85F, 0.85F});
  CHECK(feet_begin_at(stages, {0.85F, 0.85F, 0.7F}));
  CHECK(feet_begin_at(stages, {0.75F, 0.75F, 0.7F}));
  CHECK_FALSE(feet_begin_at(stages, {0.55F, 0.75F, 0.7F}));
}

TEST_CASE("where little ground is seen nothing is taken for feet") {
  CHECK(begin_on(Cloud().floor(0.8F, 1.4F, 0.8F, 1.4F, 0.1F)) == Approx(0.2F));
}
