// Deferred work: what calls tell, of which keyframe, and how long they take
#include "deferred.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

TEST_CASE("a deferred keyframe is ready after it closed and finished after that, and says so",
          "[deferred]") {
  PipelineConfig config = short_keyframes(5, 4);
  config.deferred = true;
  const IntegerTown town({});
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  std::uint32_t ready = 0;
  std::uint32_t finished = 0;
  std::vector<PointLabel> labels(40000);
  for (std::int64_t i = 0; i < 30; ++i) {
    const TownScan scan = town.scan(i);
    const ScanResult result =
        pipeline->add_scan(scan.view(), scan.T_odometry_sensor, 1 + i * kPeriodNs);
    REQUIRE(result.error.ok());
    if (result.keyframe_ready) {
      // Not by the call that completes it, but before the next one is complete.
      CHECK(i % 5 <= 3);
      CHECK_FALSE(result.keyframe_finished);
      CHECK(pipeline->keyframe().sequence == ready++);
      CHECK(pipeline->keyframe().scans.back().scan_index == 5 * ready - 1);
      CHECK_FALSE(pipeline->keyframe().static_cells.empty());
      CHECK(pipeline->labels(4, labels) > 0);
    } else {
      CHECK(pipeline->labels(0, labels) == 0);
    }
    if (!result.keyframe_finished) continue;
    // At the latest with the last scan but one.
    CHECK(i % 5 <= 3);
    CHECK(pipeline->finished_keyframe().sequence == finished++);
    CHECK_FALSE(pipeline->finished_keyframe().place.keypoints.empty());
    CHECK(pipeline->finished_keyframe().sequence == pipeline->keyframe().sequence);
  }
  CHECK(ready == 5);
  CHECK(finished == 5);
  CHECK(pipeline->work().work_left);
  const ScanResult last = pipeline->flush();
  CHECK(last.keyframe_ready);
  CHECK(last.keyframe_finished);
  CHECK_FALSE(pipeline->flush().keyframe_ready);
  CHECK_FALSE(pipeline->work(1000).work_left);
}

TEST_CASE("one call of work does one slice, or as many as begin in time", "[deferred]") {
  PipelineConfig config = short_keyframes(5, 4);
  config.deferred = true;
  config.clock_ns = fake_clock;
  const IntegerTown town({});
  const auto calls_until_finished = [&](std::uint32_t budget_us) {
    OwnedPipeline pipeline(config);
    REQUIRE(pipeline);
    for (std::int64_t i = 0; i < 5; ++i) {
      const TownScan scan = town.scan(i);
      (void)pipeline->add_scan(scan.view(), scan.T_odometry_sensor, 1 + i * kPeriodNs);
    }
    int calls = 0;
    bool ready = false;
    while (true) {
      ++calls;
      const WorkResult result = pipeline->work(budget_us);
      CHECK_FALSE((ready && result.keyframe_ready));
      ready = ready || result.keyframe_ready;
      CHECK(result.keyframe_finished == !result.work_left);
      if (!result.work_left) break;
    }
    CHECK(ready);
    return calls;
  };
  const int slices = calls_until_finished(0);
  CHECK(slices > 30);
  // A slice reads the clock about five times.
  const int calls = calls_until_finished(80);
  CHECK(calls < slices / 2);
  CHECK(calls > 2);
  CHECK(calls_until_finished(1'000'000) == 1);
}

TEST_CASE("with deferred work a budget holds for every call unless the queue is full",
          "[deferred]") {
  struct Outcome {
    std::int64_t longest_us = 0;
    std::uint32_t missed = 0;
    std::uint32_t ready = 0;
  };
  const IntegerTown town({});
  const auto drive = [&town](std::uint32_t budget_us, std::uint32_t waiting_scans) {
    PipelineConfig config = short_keyframes(5, 4);
    config.deferred = true;
    config.clock_ns = fake_clock;
    config.budget_us = budget_us;
    config.waiting_scans = waiting_scans;
    OwnedPipeline pipeline(config);
    REQUIRE(pipeline);
    Outcome outcome;
    for (std::int64_t i = 0; i < 40; ++i) {
      const TownScan scan = town.scan(i);
      const std::int64_t begin_ns = fake_ns;
      const ScanResult result =
          pipeline->add_scan(scan.view(), scan.T_odometry_sensor, 1 + i * kPeriodNs);
      outcome.longest_us = std::max(outcome.longest_us, (fake_ns - begin_ns) / 1000);
      if (!result.keyframe_ready) continue;
      ++outcome.ready;
      const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
      outcome.missed += statistics.deadline_missed ? 1U : 0U;
      // Late, but never left out.
    }
    return outcome;
  };
  // The clock advances when it is read, so that every slice takes about the same, whatever it is
  // expected to cost.
  constexpr std::uint32_t kBudget_us = 800;
  const Outcome patient = drive(kBudget_us, 50);
  CHECK(patient.longest_us < kBudget_us * 3 / 2);
  CHECK(patient.ready > 1);
  const Outcome full = drive(kBudget_us, 1);
  CHECK(full.longest_us > kBudget_us);
  CHECK(full.missed > 0);
  const Outcome ample = drive(10'000'000, 10);
  CHECK(ample.missed == 0);
  CHECK(ample.ready == 7);
}
