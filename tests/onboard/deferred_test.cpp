// Deferred work: the same results as without delay
#include "robot.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// Plainly; with calls of `work`; with room for one scan; all at once, with little time.
const std::vector<Way> kAllWays{{}, {1}, {0, 0, 1}, {2, 120, 3}};
/// Those that differ most, where the drive takes long.
const std::vector<Way> kTwoWays{{}, {2, 120, 3}};

/// Runs the drive without delay and deferred in various ways. Returns the runs.
std::vector<Run> compare(PipelineConfig config, const Drive& drive,
                         const std::vector<Way>& ways = kAllWays) {
  std::vector<Run> runs;
  config.deferred = false;
  runs.push_back(Robot(config, drive, {}).run());
  config.deferred = true;
  for (const Way& way : ways) {
    INFO("seed of the calls of work " << way.work_seed << ", budget " << way.budget_us
                                      << " us, room for " << way.waiting_scans << " scans");
    runs.push_back(Robot(config, drive, way).run());
    check_same(runs.front(), runs.back());
  }
  CHECK(runs.front().late_slices == 0);
  return runs;
}

}  // namespace

TEST_CASE("deferred work gives the same results on a drive without incidents, and none is late",
          "[deferred]") {
  const std::vector<Run> runs = compare(short_keyframes(5, 4), {});
  CHECK(runs[0].keyframes.size() == 12);
  CHECK(runs[0].relabelled >= 12);
  CHECK(runs[0].loops > 0);
  CHECK(runs[1].late_slices == 0);
  CHECK(runs[2].late_slices == 0);
  // With room for one scan, all but the first slices.
  CHECK(runs[3].late_slices > 30);
}

TEST_CASE("deferred work gives the same results whatever happens in between", "[deferred][slow]") {
  Drive drive;
  drive.flushes = {7, 8, 31};
  drive.glitches = {13, 37, 38};
  drive.empty = {0, 10, 24};
  drive.late = {16, 26};
  drive.place_insertion = {12, 33};
  drive.restart = 44;
  const std::uint32_t scans = GENERATE(2U, 4U, 10U);
  INFO(scans << " scans per keyframe");
  const std::vector<Run> runs = compare(short_keyframes(scans, 3), drive);
  CHECK(runs[0].relabelled > 2);
  CHECK(runs[1].late_slices == 0);
}

TEST_CASE("deferred work is finished first where every scan closes a keyframe",
          "[deferred][slow]") {
  Drive drive;
  drive.scans = 20;
  const std::uint32_t window = GENERATE(1U, 3U);
  const std::vector<Run> runs = compare(short_keyframes(1, window), drive);
  CHECK(runs[0].keyframes.size() == 20);
}

TEST_CASE("deferred work gives the same results where keyframes close by distance",
          "[deferred][slow]") {
  PipelineConfig config = short_keyframes(10, 3);
  config.keyframe.distance_m = 0.8F;
  CHECK(compare(config, {}, kTwoWays).front().keyframes.size() > 10);
}

TEST_CASE("deferred work gives the same results where containers are full", "[deferred][slow]") {
  PipelineConfig config = short_keyframes(5, 4);
  SECTION("the window, which evicts keyframes early") {
    config.voxel.max_cells = 1U << 15U;
    config.voxel.max_window_blocks = GENERATE(9000U, 13000U);
    compare(config, {}, kTwoWays);
  }
  SECTION("the cells, so that final labels do not find room either") {
    config.removal.window = 10;
    config.keyframe.scans = 3;
    config.voxel.max_cells = GENERATE(3000U, 8000U);
    const Run plain = compare(config, {}, kTwoWays).front();
    CHECK(plain.relabelled > 0);
  }
  SECTION("the description") {
    config.descriptor.max_voxels = 200;
    config.descriptor.max_candidates = 130;
    config.loop_search.max_bucket = 5;
    compare(config, {}, kTwoWays);
  }
}

TEST_CASE("deferred work gives the same results with other evidence", "[deferred][slow]") {
  PipelineConfig config = short_keyframes(5, 4);
  SECTION("columns") {
    config.free_space.columns = true;
    config.free_space.visibility = false;
  }
  SECTION("no final labels") { config.removal.final_labels = false; }
  SECTION("thinned scans, many images") {
    config.keyframe.downsample_leaf_m = 0.15F;
    config.free_space.images_per_keyframe = 5;
  }
  compare(config, {}, kTwoWays);
}
