// Time budget: shed work and its order
#include "src/onboard/budget.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "run.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

namespace {

constexpr std::int64_t kMillisecond = 1000000;

// A clock that advances by one tick whenever it is read: every timed part costs a tick or more,
// the same in every run.
std::int64_t fake_now_ns = 0;
std::int64_t fake_tick_ns = 0;
std::int64_t fake_clock() { return fake_now_ns += fake_tick_ns; }

PipelineConfig with_budget(std::uint32_t budget_us, std::uint32_t scans = 3) {
  PipelineConfig config = small_config();
  config.keyframe.scans = scans;
  config.budget_us = budget_us;
  config.clock_ns = &fake_clock;
  return config;
}

Scene walkers() {
  Scene scene;
  scene.columns = 360;
  scene.boxes = {standing_box({8.0, 6.0, 1.5}, {6.0, 0.3, 1.5}),
                 standing_box({30.0, 0.0, 3.0}, {0.5, 20.0, 3.0}),
                 moving_box({6.0, -2.0, 0.9}, {0.0, 1.4, 0.0}, {0.25, 0.25, 0.9}),
                 moving_box({20.0, -3.0, 0.9}, {0.0, 1.4, 0.0}, {0.4, 0.4, 0.9})};
  return scene;
}

std::vector<KeyframeRun> run_with(std::uint32_t budget_us, int keyframes, std::uint32_t scans = 3) {
  fake_now_ns = 0;
  fake_tick_ns = kMillisecond;
  return run_scene(walkers(), with_budget(budget_us, scans), static_cast<int>(scans) * keyframes,
                   [](double) { return sensor_at(0, 0); });
}

/// How many kinds of work were shed; -1 if out of order.
int depth(const KeyframeStatistics& statistics) {
  int shed = 0;
  bool ended = false;
  for (std::size_t i = 0; i < kSheds; ++i) {
    if (statistics.shed[i] == 0) {
      ended = true;
    } else if (ended) {
      return -1;
    } else {
      ++shed;
    }
  }
  return shed;
}

}  // namespace

TEST_CASE("without a budget no work is shed and the clock is not read") {
  PipelineConfig config = with_budget(0);
  config.clock_ns = nullptr;
  fake_now_ns = 7;
  for (const KeyframeRun& run :
       run_scene(walkers(), config, 9, [](double) { return sensor_at(0, 0); })) {
    CHECK(depth(run.statistics) == 0);
    CHECK_FALSE(run.statistics.deadline_missed);
    CHECK(run.statistics.removal_range_m == 0.0F);
  }
  CHECK(fake_now_ns == 7);
}

TEST_CASE("a generous budget changes nothing") {
  const auto plain = run_with(0, 3);
  const auto generous = run_with(10000000, 3);
  REQUIRE(plain.size() == generous.size());
  for (std::size_t k = 0; k < plain.size(); ++k) {
    CHECK(plain[k].labels == generous[k].labels);
    CHECK(depth(generous[k].statistics) == 0);
    CHECK_FALSE(generous[k].statistics.deadline_missed);
  }
}

TEST_CASE("work is shed in the stated order, more of it the shorter the budget", "[slow]") {
  // The second keyframe knows what the first one cost.
  int deepest = 4;
  std::vector<bool> seen(5, false);
  for (std::uint32_t budget_us = 500; budget_us <= 60000; budget_us += 500) {
    INFO("budget " << budget_us << " us");
    const KeyframeStatistics statistics = run_with(budget_us, 2)[1].statistics;
    const int now = depth(statistics);
    REQUIRE(now >= 0);
    CHECK(now <= deepest);
    deepest = now;
    seen[static_cast<std::size_t>(now)] = true;
    CHECK((statistics.removal_range_m > 0.0F) == (statistics.shed_of(Shed::kFarCells) > 0));
  }
  // Nothing; search; and insertion; and description; and far cells.
  CHECK(seen == std::vector<bool>(5, true));
}

TEST_CASE("shed results are missing in the keyframe, and labels stay complete") {
  const auto runs = run_with(500, 3);
  REQUIRE(runs.size() == 3);
  CHECK(depth(runs[1].statistics) == 4);
  CHECK(runs[1].statistics.deadline_missed);
  CHECK(runs[1].dynamic_cells.empty());
  CHECK(runs[1].static_cells.size() == runs[1].statistics.cells);
  for (const auto& labels : runs[1].labels) {
    for (const PointLabel label : labels) REQUIRE(label == PointLabel::kStatic);
  }
}

TEST_CASE("when there is time for some cells, the near ones are filtered") {
  // With all the time in the world, the walker 6 m away is found.
  const std::size_t walker = run_with(0, 2, 10)[1].dynamic_cells.size();
  REQUIRE(walker > 0);
  bool found_again = false;
  for (std::uint32_t budget_us = 6000; budget_us <= 8000; budget_us += 250) {
    const KeyframeRun run = run_with(budget_us, 2, 10)[1];
    const float range_m = run.statistics.removal_range_m;
    if (range_m == 0.0F) continue;
    INFO("budget " << budget_us << " us, filtered to " << range_m << " m");
    for (const FineCell& cell : run.dynamic_cells) CHECK(cell.position.norm() <= range_m + 0.5F);
    CHECK(run.statistics.shed_of(Shed::kFarCells) > 0);
    found_again = found_again || run.dynamic_cells.size() == walker;
  }
  CHECK(found_again);
}

TEST_CASE("a part that was shed is tried again after a while") {
  // Enough for everything but the outlier that the first keyframe was.
  fake_now_ns = 0;
  Budget budget(with_budget(10000));
  fake_tick_ns = 20 * kMillisecond;
  budget.measure(Budget::Part::kDescribing, 1, [] {});
  fake_tick_ns = 0;
  int keyframes = 0;
  do {
    budget.start();
    ++keyframes;
  } while (!budget.affords(Budget::Part::kDescribing) && keyframes < 100);
  CHECK(keyframes > 2);
  CHECK(keyframes < 12);
}

TEST_CASE("a budget needs a clock and must be possible") {
  PipelineConfig config = with_budget(5000);
  CHECK(config.validate().code == ErrorCode::kOk);
  config.clock_ns = nullptr;
  CHECK_THAT(config.validate().message, Catch::Matchers::Contains("clock"));
  CHECK(with_budget(99).validate().code == ErrorCode::kInvalidConfig);
  CHECK(with_budget(10000001).validate().code == ErrorCode::kInvalidConfig);
}
