// Slices of the evidence: what each of them needs
#include "src/onboard/removal/bayes_filter.hpp"
#include "stages.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

TEST_CASE("a slice of the evidence is as large as it affords, wherever new candidates lie",
          "[deferred]") {
  PipelineConfig config = small_config();
  config.deferred = true;
  config.keyframe.scans = 10;
  config.free_space.images_per_keyframe = 10;
  Stages stages(config);
  for (std::uint32_t scan = 0; scan < 10; ++scan) {
    REQUIRE(stages.window.image_for(scan, {}) != nullptr);
  }
  std::vector<Eigen::Vector3f> floor;  // a point in every cell
  for (int i = 0; i < 180 * 180; ++i) {
    const Eigen::Vector2f at(static_cast<float>(i % 180 - 90), static_cast<float>(i / 180 - 90));
    floor.emplace_back(0.2F * at.x() + 0.1F, 0.2F * at.y() + 0.1F, 0.1F);
  }
  stages.add(floor);
  stages.build_cells();
  std::uint32_t candidates = 0;
  for (std::uint32_t b = 0; b < stages.cells.blocks().size(); ++b) {
    const Block& block = stages.cells.blocks()[b];
    if (block.index.x >= 0) continue;
    stages.cells.marks(b).candidate = block.occupied;
    candidates += popcount(block.occupied);
  }
  BayesFilter filter;
  const MemoryBlock memory = lay_out([&](Arena& arena) { filter.allocate(arena, config); });
  filter.begin(stages.window, stages.cells);
  REQUIRE(filter.images() == 10);

  constexpr std::uint32_t kFloorOfRun = 16 * 16;  // cells of 16 blocks
  std::uint32_t slices = 0;
  std::uint32_t projections = 0;
  bool is_left = true;
  while (is_left) {
    CHECK(filter.step_projections() <= BayesFilter::kSliceProjections);
    CHECK(filter.step_blocks() <= 4096);
    projections += filter.step_projections();
    is_left = filter.step(stages.window, stages.cells);
    ++slices;
  }
  CHECK(candidates > 12'000);
  CHECK(projections == 10 * candidates);
  CHECK(slices <= 1 + projections / (BayesFilter::kSliceProjections - 10 * kFloorOfRun));
}
