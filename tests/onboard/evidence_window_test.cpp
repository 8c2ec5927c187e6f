// Range images, which scans are painted, and what later keyframes count
#include "src/onboard/removal/evidence_window.hpp"

#include "stages.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

TEST_CASE("the window of ten keyframes of the densest sensor fits 64 MB") {
  const PipelineConfig config = preset(SensorKind::kOs2_128);
  REQUIRE(config.removal.window == 10);
  Arena measuring = Arena::measuring();
  auto window = std::make_unique<EvidenceWindow>();
  window->allocate(measuring, config);
  CHECK(measuring.used() <= 64'000'000);
}

TEST_CASE("a range image keeps the smallest range around each pixel and nothing elsewhere") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  // A wall 10 m ahead, and nothing anywhere else.
  for (float y = -2.0F; y <= 2.0F; y += 0.02F) {
    for (float z = -1.0F; z <= 0.3F; z += 0.02F) points.emplace_back(10.0F, y, z);
  }
  points.emplace_back(5.0F, 0.0F, -0.1F);  // one nearer point
  RangeImage& image = *stages.window.image_for(0, Pose{});
  stages.painter.paint(view_of(points), image.pixels);
  const auto seen_m = [&](float x, float y, float z) {
    std::int32_t pixel = 0;
    float range = 0.0F;
    stages.painter.projection().project(&x, &y, &z, 1, &pixel, &range);
    REQUIRE(pixel != ImageProjection::kOutside);
    return static_cast<float>(image.pixels[pixel]) / kRangeUnitsPerMetre;
  };
  CHECK(seen_m(3.0F, 0.3F, -0.1F) == Approx(10.0F).margin(0.1F));
  CHECK(seen_m(3.0F, 0.0F, -0.06F) == Approx(5.0F).margin(0.02F));
  CHECK(seen_m(-3.0F, 0.0F, -0.1F) == 0.0F);
  CHECK(seen_m(3.0F, 3.0F, -0.1F) == 0.0F);
}

TEST_CASE("the first and the last scan of a keyframe are painted, others evenly between") {
  for (const std::uint32_t images : {1U, 2U, 3U, 4U, 10U}) {
    PipelineConfig config = small_config();
    config.free_space.images_per_keyframe = images;
    Stages stages(config);
    std::vector<std::uint32_t> painted;
    for (std::uint32_t scan = 0; scan < 10; ++scan) {
      if (stages.window.image_for(scan, Pose{}) != nullptr) painted.push_back(scan);
    }
    REQUIRE(painted.size() == images);
    CHECK(painted.front() == 0);
    if (images > 1) CHECK(painted.back() == 9);
  }
}

TEST_CASE("when keyframes close by distance the latest scan is always painted") {
  PipelineConfig config = small_config();
  config.keyframe.distance_m = 5.0F;
  config.free_space.images_per_keyframe = 3;
  Stages stages(config);
  for (std::uint32_t scan = 0; scan < 10; ++scan) {
    CHECK(stages.window.image_for(scan, Pose{}) != nullptr);
    CHECK(stages.window.current().image_count <= 3);
  }
  CHECK(stages.window.current().image_count == 3);
}

TEST_CASE("of every few images the last one counts, and as many before it as the stride leaves") {
  constexpr std::uint32_t kImages = 4;
  PipelineConfig config = small_config();
  config.free_space.images_per_keyframe = kImages;
  for (std::uint32_t shown = 0; shown < kImages; ++shown) {
    Stages stages(config);
    // One image saw 10 m far in every direction, the others nothing.
    std::uint32_t painted = 0;
    for (std::uint32_t scan = 0; scan < config.keyframe.scans; ++scan) {
      RangeImage* const image = stages.window.image_for(scan, Pose{});
      if (image == nullptr) continue;
      const auto pixel = static_cast<std::uint16_t>(10.0F * kRangeUnitsPerMetre);
      std::fill_n(image->pixels, stages.window.current().projection.pixels(),
                  painted++ == shown ? pixel : kNoRange);
    }
    REQUIRE(painted == kImages);
    for (std::uint32_t stride = 1; stride <= kImages + 1; ++stride) {
      INFO("image " << shown << ", stride " << stride);
      const Grid grid = stages.scans.grid();
      const Eigen::Vector3f point =
          (Eigen::Vector3d(3.0, 0.3, -0.1) - grid.origin_m()).cast<float>();
      std::int32_t log_odds = 0;
      stages.window.current().observe(stride, grid,
                                      {&point.x(), &point.y(), &point.z(), &log_odds, 1});
      CHECK((log_odds > 0) == ((kImages - 1 - shown) % stride == 0));
    }
  }
}

TEST_CASE("ground is not part of the occupancy that later keyframes count") {
  Stages stages;
  for (int keyframe = 0; keyframe < 2; ++keyframe) {
    if (keyframe > 0) stages.record_and_begin();
    REQUIRE(stages.take(
                Cloud().floor(0.0F, 4.0F, 0.0F, 4.0F, 0.02F).column(1.1F, 1.1F, 0.2F, 1.8F)) > 0);
    stages.window.leave_out_ground(stages.cells);
  }
  const auto occupied_before = [&](float x, float y, float z) {
    const std::uint32_t row = stages.row_at({x, y, z});
    const std::uint64_t cells = stages.window.blocks().occupied(stages.cells.block_of_row(row), 1);
    return (cells >> stages.cells.bit_of_row(row) & 1U) != 0;
  };
  CHECK(occupied_before(1.1F, 1.1F, 1.1F));
  CHECK_FALSE(occupied_before(3.1F, 3.1F, 0.02F));
}
