// Time budget of a call
#include "src/onboard/budget.hpp"

#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

namespace {

// A clock that advances by one millisecond whenever it is read.
std::int64_t fake_now_ns = 0;
std::int64_t fake_clock() { return fake_now_ns += 1000000; }

PipelineConfig with_budget(std::uint32_t budget_us) {
  PipelineConfig config = small_config();
  config.keyframe.scans = 3;
  config.budget_us = budget_us;
  config.clock_ns = &fake_clock;
  return config;
}

std::vector<KeyframeRun> run_with(const PipelineConfig& config) {
  Scene scene;
  scene.columns = 360;
  scene.boxes = {standing_box({30.0, 0.0, 3.0}, {0.5, 20.0, 3.0}),
                 moving_box({6.0, -2.0, 0.9}, {0.0, 1.4, 0.0}, {0.25, 0.25, 0.9})};
  return run_scene(scene, config, 9, [](double) { return sensor_at(0, 0); });
}

}  // namespace

TEST_CASE("without a budget no deadline is missed and the clock is not read") {
  PipelineConfig config = with_budget(0);
  config.clock_ns = nullptr;
  fake_now_ns = 7;
  for (const KeyframeRun& run : run_with(config)) CHECK_FALSE(run.statistics.deadline_missed);
  CHECK(fake_now_ns == 7);
}

TEST_CASE("a call that takes longer than the budget is counted and leaves nothing out") {
  const auto generous = run_with(with_budget(10000000));
  const auto late = run_with(with_budget(500));
  REQUIRE(generous.size() == 3);
  REQUIRE(late.size() == 3);
  for (std::size_t k = 0; k < late.size(); ++k) {
    CHECK_FALSE(generous[k].statistics.deadline_missed);
    CHECK(late[k].statistics.deadline_missed);
    CHECK(late[k].labels == generous[k].labels);
    CHECK(late[k].static_cells.size() == generous[k].static_cells.size());
  }
}

TEST_CASE("a slice that took long is tried again after a while") {
  Budget budget(with_budget(10000));
  budget.start();
  budget.measure_slice(1, [] { fake_now_ns += 20000000; });
  int calls = 0;
  do {
    budget.start();
    ++calls;
  } while (!budget.affords(1) && calls < 100);
  CHECK(calls > 2);
  CHECK(calls < 15);
}

TEST_CASE("a budget needs a clock and must be possible") {
  PipelineConfig config = with_budget(5000);
  CHECK(config.validate().code == ErrorCode::kOk);
  config.clock_ns = nullptr;
  CHECK_THAT(config.validate().message, Catch::Matchers::Contains("clock"));
  CHECK(with_budget(99).validate().code == ErrorCode::kInvalidConfig);
  CHECK(with_budget(10000001).validate().code == ErrorCode::kInvalidConfig);
}
