// Tests of the totals that a C program is told: sums and largest values over all keyframes
#include "c_pipeline.hpp"
#include "tests/regression/tilted_town.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::regression;
using unimapper::test::pose_of;

namespace {

std::int64_t ticks_ns = 0;
std::int64_t ticking_clock() { return ticks_ns += 250000; }

/// A pipeline that is short of everything.
struct ShortOfEverything {
  explicit ShortOfEverything(std::uint32_t budget_us) {
    ticks_ns = 0;
    um_config config;
    REQUIRE(um_config_init(&config, UM_SENSOR_HDL_64E) == UM_OK);
    config.event_capacity = 4096;
    config.clock_ns = ticking_clock;
    config.budget_us = budget_us;
    config.keyframe_scans = 3;
    config.keyframe_range_max_m = 45.0F;
    config.keyframe_max_points_per_scan = 11000;
    config.voxel_max_cells = 24000;
    config.loop_search_max_places = 4;
    for (const auto& [name, value] : {std::pair{"voxel.max_voxels", "1500"},
                                      {"voxel.max_window_blocks", "8000"},
                                      {"removal.window", "3"},
                                      {"descriptor.max_voxels", "900"},
                                      {"loop_search.max_bucket", "5"},
                                      {"search_scope.min_keyframe_gap", "2"}}) {
      REQUIRE(um_config_set(&config, name, value, nullptr) == UM_OK);
    }
    block = MemoryBlock(um_required_bytes(&config));
    REQUIRE(um_init(&config, block.data(), block.size(), &pipeline, nullptr) == UM_OK);
  }
  MemoryBlock block;
  um_pipeline* pipeline = nullptr;
};

}  // namespace

TEST_CASE("health is the sum over all keyframes, of largest values the largest") {
  for (const std::uint32_t budget_us : {900U, 3100U, 60000U}) {
    INFO("budget " << budget_us);
    const ShortOfEverything robot(budget_us);
    um_pipeline* const pipeline = robot.pipeline;
    IntegerTown::Options options = sparse(12);
    options.ground_points = 3000;
    const IntegerTown town(options);
    um_health expected{};
    std::uint64_t refused_events = 0;
    std::uint64_t dropped_in_events[16] = {};
    std::uint64_t missed_events = 0;
    std::uint64_t closed_events = 0;
    const auto look = [&] {
      um_keyframe keyframe;
      REQUIRE(um_keyframe_get(pipeline, &keyframe) == UM_OK);
      const um_statistics& s = keyframe.statistics;
      CHECK(keyframe.sequence == expected.keyframes);
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
    };
    constexpr int kScans = 31;
    for (int i = 0; i < kScans; ++i) {
      TownScan scan = tilted().apply(town.scan(i));
      // Exactly 17 points of every scan are none.
      for (std::size_t k = 0; k < 17; ++k) {
        scan.xyz[60 * k + k % 3] = std::numeric_limits<float>::quiet_NaN();
      }
      const bool late = i == 5 || i == 11;
      const um_points points{scan.xyz.data(), scan.xyz.size() / 3, 12, 0, 4, 8};
      const um_pose pose = pose_of(scan.T_odometry_sensor);
      std::int32_t ready = 0;
      const um_status status =
          um_add_scan(pipeline, &points, &pose, late ? 1 : 1 + i * std::int64_t{100000000}, &ready);
      CHECK(status == (late ? UM_TIME_REVERSED : UM_OK));
      if (ready == 1) look();
    }
    std::int32_t ready = 0;
    REQUIRE(um_flush(pipeline, &ready) == UM_OK);
    if (ready == 1) look();

    um_health health;
    REQUIRE(um_health_get(pipeline, &health) == UM_OK);
    CHECK(health.scans == kScans);
    CHECK(health.scans_refused == 2);
    CHECK(health.keyframes == 10);
    CHECK(health.keyframes == expected.keyframes);
    CHECK(health.points_in == expected.points_in);
    CHECK(health.points_dynamic == expected.points_dynamic);
    CHECK(health.deadline_misses == expected.deadline_misses);
    for (int i = 0; i < 16; ++i) {
      INFO("element " << i);
      CHECK(health.dropped[i] == expected.dropped[i]);
      CHECK(health.fullest[i].used == expected.fullest[i].used);
      CHECK(health.fullest[i].capacity == expected.fullest[i].capacity);
      CHECK(health.longest_stage_us[i] == expected.longest_stage_us[i]);
    }
    CHECK(health.dropped[UM_DROP_NOT_FINITE] == 17 * (kScans - 2));

    um_event event;
    while (um_event_pop(pipeline, &event) == UM_OK) {
      const auto first = static_cast<std::size_t>(event.values[0]);
      switch (event.id) {
        case UM_EVENT_KEYFRAME_CLOSED:
          ++closed_events;
          break;
        case UM_EVENT_SCAN_REFUSED:
          ++refused_events;
          break;
        case UM_EVENT_DROPPED:
          dropped_in_events[first] += static_cast<std::uint64_t>(event.values[1]);
          break;
        case UM_EVENT_DEADLINE_MISSED:
          ++missed_events;
          break;
        default:
          break;
      }
    }
    CHECK(um_events_lost(pipeline) == 0);
    CHECK(closed_events == health.keyframes);
    CHECK(refused_events == health.scans_refused);
    CHECK(missed_events == health.deadline_misses);
    for (int i = 0; i < 16; ++i) {
      INFO("cause " << i);
      CHECK(dropped_in_events[i] == health.dropped[i]);
    }
    CHECK(health.dropped[UM_DROP_SCAN_TOO_LARGE] > 0);
    CHECK(health.dropped[UM_DROP_VOXELS_FULL] > 0);

    REQUIRE(um_reset(pipeline) == UM_OK);
    REQUIRE(um_health_get(pipeline, &health) == UM_OK);
    CHECK(health.scans == 0);
    CHECK(health.keyframes == 0);
  }
}
