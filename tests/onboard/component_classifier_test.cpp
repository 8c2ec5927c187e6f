// Classification of connected components
#include "src/onboard/removal/component_classifier.hpp"

#include "stages.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

TEST_CASE("obstacles that touch are one component, across block borders; others do not count") {
  // A staircase of cells that touch by their corners only, and one apart.
  Cloud points;
  for (int i = 0; i < 12; ++i) {
    const float at = 0.1F + 0.2F * static_cast<float>(i);
    points.emplace_back(at, at, 3.0F + at);
  }
  points.emplace_back(10.0F, 10.0F, 3.0F);
  Stages stages(points);
  REQUIRE(stages.cells.size() == 13);
  // A third of the staircase is dynamic: enough for all of it.
  stages.set_rows(4, &CellMarks::dynamic);
  CHECK(stages.classify_components() == 1);
  CHECK(stages.dynamic_cells() == 12);
  CHECK_FALSE(stages.has({10.0F, 10.0F, 3.0F}, &CellMarks::dynamic));
}

TEST_CASE(
    "hardly dynamic components become static, confirmed static cells resist their component") {
  Stages stages(Cloud().row(40));
  stages.set_rows(1, &CellMarks::dynamic);
  stages.classify_components();
  CHECK_FALSE(stages.cells.has(0, &CellMarks::dynamic));

  stages.set_rows(20, &CellMarks::dynamic);
  stages.cells.set(39, &CellMarks::confirmed_static);
  stages.classify_components();
  CHECK(stages.cells.has(38, &CellMarks::dynamic));
  CHECK_FALSE(stages.cells.has(39, &CellMarks::dynamic));
}

TEST_CASE("evidence on few cells of a component outweighs its many unobserved cells") {
  Stages stages(Cloud().row(40));
  stages.set_rows(3, &CellMarks::dynamic);
  std::vector<std::int16_t> log_odds(stages.cells.size(), 0);
  std::fill_n(log_odds.begin(), 3, std::int16_t{850});
  stages.classify_components(log_odds);
  CHECK(stages.cells.has(39, &CellMarks::dynamic));
}

TEST_CASE("low cells follow an obstacle but do not tie obstacles together") {
  Cloud points;
  points.floor(0.0F, 4.0F, 0.0F, 4.0F, 0.02F);
  for (const float x : {1.1F, 2.5F}) points.column(x, 1.1F, 0.2F, 1.8F);
  for (float x = 1.1F; x < 2.5F; x += 0.1F) points.emplace_back(x, 1.1F, 0.25F);  // a low kerb
  Stages stages;
  REQUIRE(stages.take(points) > 0);
  stages.set_column(1.1F, 1.1F, 0.5F, 1.8F, &CellMarks::dynamic);
  // Its foot follows even where ground was taken for it before.
  REQUIRE(stages.has({1.1F, 1.1F, 0.25F}, &CellMarks::follower));
  const bool was_ground = GENERATE(false, true);
  if (was_ground)
    stages.cells.set(stages.row_at({1.1F, 1.1F, 0.25F}), &CellMarks::confirmed_static);
  stages.classify_components();
  const auto dynamic = [&](float x, float z) {
    return stages.has({x, 1.1F, z}, &CellMarks::dynamic);
  };
  CHECK(dynamic(1.1F, 1.5F));
  CHECK(dynamic(1.1F, 0.25F));
  CHECK_FALSE(dynamic(1.9F, 0.25F));
  CHECK_FALSE(dynamic(2.5F, 1.5F));
  CHECK_FALSE(dynamic(2.5F, 0.25F));
}

TEST_CASE("a confirmed static wall does not tie a walker to what stands behind it") {
  Stages stages(Cloud().block(1.1F, 12, 1, 3.0F, 5.0F));
  stages.set_column(1.1F, 1.1F, 3.1F, 5.0F, &CellMarks::dynamic);
  stages.set_column(1.3F, 1.1F, 3.1F, 5.0F, &CellMarks::dynamic);
  stages.set_column(1.5F, 1.1F, 3.1F, 5.0F, &CellMarks::confirmed_static);
  CHECK(stages.classify_components() == 1);
  CHECK(stages.has({1.1F, 1.1F, 4.1F}, &CellMarks::dynamic));
  CHECK_FALSE(stages.has({1.5F, 1.1F, 4.1F}, &CellMarks::dynamic));
  CHECK_FALSE(stages.has({1.7F, 1.1F, 4.1F}, &CellMarks::dynamic));
}

TEST_CASE("what was proven dynamic a keyframe ago connects, confirmed static or not") {
  const Cloud points = Cloud().block(1.1F, 5, 1, 3.0F, 5.0F);
  Stages stages(points);
  stages.set_column(1.5F, 1.1F, 3.1F, 5.0F, &CellMarks::dynamic);
  stages.set_column(1.5F, 1.1F, 3.1F, 5.0F, &CellMarks::proven);
  stages.record_and_begin();
  stages.take(points);
  stages.set_column(1.5F, 1.1F, 3.1F, 5.0F, &CellMarks::confirmed_static);
  CHECK(stages.classify_components() == 1);
}

TEST_CASE("single returns connect nothing where a surface would leave several") {
  const auto components = [](float stray_range_m) {
    Stages stages;
    stages.stray = {{2.0F, 0.0F, 3.0F}, stray_range_m};
    stages.take(
        Cloud().column(1.1F, 1.1F, 2.5F, 3.5F).column(3.1F, 1.1F, 2.5F, 3.5F).row(9, 1.3F, 1.1F));
    stages.set_rows(stages.cells.size(), &CellMarks::dynamic);
    return stages.classify_components();
  };
  CHECK(components(0.0F) == 1);
  CHECK(components(5.0F) == 2);
}

TEST_CASE("how near a single return is a stray one follows from the spacing of rays") {
  FreeSpaceConfig measured;
  KeyframeConfig keyframe;
  // 0.2 x 2 degrees: a cell of 0.2 m holds eight rays of a scan at 6.4 m.
  measured.ray_spacing_deg = 0.2F;
  measured.ring_spacing_deg = 2.0F;
  CHECK(stray_range_m(measured, keyframe, 0.2F) == Approx(6.406F).margin(0.001F));
  // A pattern that does not repeat, two cells apart at 120 m: a quarter of a ray; eight at 21 m.
  measured.ray_spacing_deg = measured.ring_spacing_deg = 0.0F;
  measured.full_weight_range_m = 120.0F;
  CHECK(stray_range_m(measured, keyframe, 0.2F) == Approx(21.213F).margin(0.001F));
  keyframe.downsample_leaf_m = 0.1F;
  CHECK(stray_range_m(measured, keyframe, 0.2F) == 0.0F);
  keyframe.downsample_leaf_m = 0.0F;
  measured.full_weight_range_m = 0.0F;
  CHECK(stray_range_m(measured, keyframe, 0.2F) == 0.0F);
}

TEST_CASE("strong evidence of a cell's own survives a static component") {
  Stages stages(Cloud().row(80));
  stages.set_rows(2, &CellMarks::dynamic);
  stages.cells.set(0, &CellMarks::confirmed_dynamic);
  stages.classify_components();
  CHECK(stages.cells.has(0, &CellMarks::dynamic));
  CHECK_FALSE(stages.cells.has(1, &CellMarks::dynamic));
}

TEST_CASE("what may be a pole is not seen through by rays that pass beside it") {
  // Dynamic cells of an obstacle that was all seen through once, rays `spacing_deg` apart.
  const auto left_dynamic = [](const Cloud& points, float distance_m, float spacing_deg) {
    Stages stages(points);
    stages.set_rows(stages.cells.size(), &CellMarks::dynamic);
    stages.viewpoint = {{1.1F, 1.1F - distance_m, 4.0F}, spacing_deg};
    stages.classify_components();
    return stages.dynamic_cells();
  };
  const Cloud pole = Cloud().block(1.1F, 2, 1, 3.0F, 5.0F);
  // Rays 0.7 degrees apart are 6 cm apart 4.9 m away.
  CHECK(left_dynamic(pole, 5.4F, 0.7F) == 0);
  CHECK(left_dynamic(pole, 4.4F, 0.7F) == 20);
  CHECK(left_dynamic(pole, 9.0F, 0.35F) == 20);
  CHECK(left_dynamic(pole, 9.0F, 0.0F) == 20);
  const Cloud walker = Cloud().block(1.1F, 3, 2, 3.0F, 4.8F);
  CHECK(left_dynamic(walker, 9.0F, 0.7F) == 54);
  const Cloud sign_on_pole = Cloud().block(1.1F, 4, 1, 5.0F, 5.6F).block(1.3F, 1, 1, 3.0F, 5.6F);
  CHECK(left_dynamic(sign_on_pole, 9.0F, 0.7F) == 0);
  const Cloud lamp = Cloud().block(1.1F, 5, 1, 5.8F, 6.0F).block(1.1F, 1, 1, 3.0F, 6.0F);
  CHECK(left_dynamic(lamp, 9.0F, 0.7F) == 0);
  const Cloud van = Cloud().block(1.1F, 8, 3, 3.0F, 5.4F);
  CHECK(left_dynamic(van, 9.0F, 0.7F) == 8 * 3 * 12);
  // As narrow as a pole, but all its evidence says so.
  const Cloud fragment = Cloud().block(1.1F, 2, 1, 3.0F, 3.6F);
  CHECK(left_dynamic(fragment, 9.0F, 0.7F) == 6);
}

TEST_CASE("a fragment as narrow as a pole is static where some of its evidence says so") {
  Stages stages(Cloud().block(1.1F, 2, 1, 3.0F, 3.6F));
  stages.set_rows(2, &CellMarks::dynamic);
  stages.viewpoint = {{1.1F, -7.9F, 4.0F}, 0.7F};
  // 1700 of 3400 thousandths are for dynamic: enough for anything else.
  stages.classify_components();
  CHECK_FALSE(stages.cells.has(0, &CellMarks::dynamic));
}

TEST_CASE("a narrow fragment half of which was there a keyframe ago has not moved") {
  const auto stays = [](float height_before_m) {
    Stages stages(Cloud().block(1.1F, 1, 1, 3.0F, 3.0F + height_before_m));
    stages.record_and_begin();
    stages.take(Cloud().block(1.1F, 1, 1, 3.0F, 3.8F));
    stages.set_rows(4, &CellMarks::dynamic);
    stages.viewpoint = {{1.1F, -7.9F, 4.0F}, 0.7F};
    stages.classify_components();
    return stages.cells.has(0, &CellMarks::dynamic);
  };
  CHECK_FALSE(stays(0.4F));
  CHECK(stays(0.2F));
}

TEST_CASE("a pole does not stay dynamic because it was taken for dynamic before") {
  const auto stays = [](int wide) {
    const Cloud points = Cloud().block(1.1F, wide, 1, 3.0F, 5.0F);
    Stages stages(points);
    stages.set_rows(stages.cells.size(), &CellMarks::dynamic);
    stages.set_rows(stages.cells.size(), &CellMarks::proven);
    stages.record_and_begin();
    stages.take(points);
    stages.classify_components();
    return stages.cells.has(0, &CellMarks::dynamic);
  };
  CHECK_FALSE(stays(2));
  CHECK(stays(3));
}

namespace {

/// A wall that was never seen before, with somebody before it: `width` x `height` cells that were
/// seen through, and behind them, on the wall, one more column of his with `beside` thousandths.
struct WalkerAtWall {
  WalkerAtWall(int width, int height, std::int16_t own, std::int16_t beside,
               const PipelineConfig& config = small_config())
      : stages(config) {
    const float top = 3.0F + 0.2F * static_cast<float>(height);
    Cloud points;
    points.block(1.1F, 40, 1, 3.0F, 7.0F).column(2.9F, 1.3F, 3.0F, top);
    const auto x_of = [](int i) { return 3.1F + 0.2F * static_cast<float>(i); };
    for (int i = 0; i < width; ++i) points.column(x_of(i), 1.3F, 3.0F, top);
    stages.take(points);
    std::vector<std::int16_t> log_odds(stages.cells.size(), -510);
    for (float z = 3.1F; z < top; z += 0.2F) {
      for (int i = 0; i < width; ++i) {
        const std::uint32_t row = stages.row_at({x_of(i), 1.3F, z});
        log_odds[row] = own;
        stages.cells.set(row, &CellMarks::dynamic);
      }
      log_odds[stages.row_at({2.9F, 1.3F, z})] = beside;
    }
    stages.classify_components(log_odds);
  }
  [[nodiscard]] bool is_dynamic(float x, float y, float z) const {
    return stages.has({x, y, z}, &CellMarks::dynamic);
  }
  Stages stages;
};

}  // namespace

TEST_CASE("a walker stays dynamic before a wall that came into view with him") {
  const WalkerAtWall with(3, 5, 850, -255);
  CHECK(with.is_dynamic(3.1F, 1.3F, 3.1F));
  CHECK(with.is_dynamic(3.5F, 1.3F, 3.9F));
  // His cells where he was seen once, too; the wall, which was seen twice, not.
  CHECK(with.is_dynamic(2.9F, 1.3F, 3.5F));
  CHECK_FALSE(with.is_dynamic(3.1F, 1.1F, 3.5F));
  CHECK_FALSE(with.is_dynamic(3.1F, 1.1F, 5.5F));
}

TEST_CASE("few, low, narrow or weakly seen-through cells on a wall are no cluster") {
  CHECK(WalkerAtWall(3, 5, 850, -510).is_dynamic(3.1F, 1.3F, 3.1F));
  CHECK_FALSE(WalkerAtWall(4, 4, 850, -510).is_dynamic(3.1F, 1.3F, 3.1F));
  CHECK_FALSE(WalkerAtWall(2, 10, 850, -510).is_dynamic(3.1F, 1.3F, 3.1F));
  CHECK_FALSE(WalkerAtWall(3, 5, 299, -510).is_dynamic(3.1F, 1.3F, 3.1F));
  CHECK(WalkerAtWall(3, 5, 300, -510).is_dynamic(3.1F, 1.3F, 3.1F));
  CHECK_FALSE(WalkerAtWall(3, 5, 850, -256).is_dynamic(2.9F, 1.3F, 3.1F));

  PipelineConfig config = small_config();
  config.removal.cluster_cells = 16;
  CHECK_FALSE(WalkerAtWall(3, 5, 850, -510, config).is_dynamic(3.1F, 1.3F, 3.1F));
  config.removal.cluster_cells = 0;
  CHECK_FALSE(WalkerAtWall(3, 5, 850, -510, config).is_dynamic(3.1F, 1.3F, 3.1F));
}
