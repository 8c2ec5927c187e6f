// Tests of the totals that a C program is told: sums and largest values over all keyframes
#include <algorithm>
#include <catch2/catch.hpp>

#include "c_pipeline.hpp"

using namespace unimapper::test;

namespace {

std::int64_t ticks_ns = 0;
std::int64_t ticking_clock() { return ticks_ns += 250000; }

}  // namespace

TEST_CASE("health is the sum over all keyframes, of largest values the largest") {
  um_config config = small_c_config();
  config.event_capacity = 256;
  config.clock_ns = ticking_clock;
  config.budget_us = GENERATE(1U, 100000U);
  config.voxel_max_cells = 2048;
  const CPipeline pipeline(config);
  um_health expected{};
  pipeline.drive([&] {
    const um_statistics s = pipeline.keyframe().statistics;
    ++expected.keyframes;
    expected.points_in += s.points_in;
    expected.points_dynamic += s.points_dynamic;
    expected.deadline_misses += s.deadline_missed;
    for (int i = 0; i < 16; ++i) {
      expected.dropped[i] += s.dropped[i];
      expected.fullest[i].used = std::max(expected.fullest[i].used, s.capacity[i].used);
      expected.fullest[i].capacity = s.capacity[i].capacity;
      expected.longest_stage_us[i] = std::max(expected.longest_stage_us[i], s.stage_us[i]);
    }
  });
  CHECK(pipeline.add({}, std::int64_t{1} << 34U) == UM_EMPTY_SCAN);
  const um_health health = pipeline.health();
  CHECK(health.scans == kScans + 1);
  CHECK(health.scans_refused == 1);
  CHECK(health.keyframes == 3);
  CHECK(health.keyframes == expected.keyframes);
  CHECK(health.points_in == expected.points_in);
  CHECK(health.points_dynamic == expected.points_dynamic);
  CHECK(health.deadline_misses == expected.deadline_misses);
  CHECK(health.deadline_misses == (config.budget_us == 1 ? 3 : 0));
  CHECK(health.dropped[UM_DROP_CELLS_FULL] > 0);
  for (int i = 0; i < 16; ++i) {
    INFO("element " << i);
    CHECK(health.dropped[i] == expected.dropped[i]);
    CHECK(health.fullest[i].used == expected.fullest[i].used);
    CHECK(health.fullest[i].capacity == expected.fullest[i].capacity);
    CHECK(health.longest_stage_us[i] == expected.longest_stage_us[i]);
  }

  std::uint64_t misses = 0;
  std::uint64_t dropped = 0;
  um_event event;
  while (um_event_pop(pipeline, &event) == UM_OK) {
    misses += event.id == UM_EVENT_DEADLINE_MISSED ? 1 : 0;
    if (event.id == UM_EVENT_DROPPED && event.values[0] == UM_DROP_CELLS_FULL) {
      dropped += static_cast<std::uint64_t>(event.values[1]);
    }
  }
  CHECK(um_events_lost(pipeline) == 0);
  CHECK(misses == health.deadline_misses);
  CHECK(dropped == health.dropped[UM_DROP_CELLS_FULL]);

  REQUIRE(um_reset(pipeline) == UM_OK);
  CHECK(pipeline.health().scans == 0);
  CHECK(pipeline.health().keyframes == 0);
  um_health older;
  older.struct_size = 1;
  CHECK(um_health_get(pipeline, &older) == UM_UNKNOWN_VERSION);
}
