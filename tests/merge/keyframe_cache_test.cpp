// Tests of keyframes that are read on demand, and of merges under a limit of memory
#include "unimapper/merge/keyframe_cache.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "src/merge/limited_cache.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/temporary_directory.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/keyframe_level.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::drive_roads;
using unimapper::merge::testing::make_town;
using unimapper::merge::testing::record;

namespace {

/// The same session without cells and images, which are read from `whole` on demand.
SessionData on_demand(const SessionData& whole, KeyframeCache& cache,
                      std::atomic<int>* times_read = nullptr) {
  SessionData light = whole;
  for (KeyframeRecord& keyframe : light.keyframes) drop_contents(keyframe);
  light.contents = cache.contents([&whole, times_read](std::uint32_t sequence) {
    if (times_read != nullptr) ++*times_read;
    return whole.keyframes.at(sequence);
  });
  return light;
}

/// Every exported file but the durations; voxels are in a file of the folder, or in memory.
std::map<std::string, std::string> exported(const std::vector<SessionData>& sessions,
                                            const MergeConfig& config, bool in_file = false) {
  const TemporaryDirectory folder;
  const std::filesystem::path scratch = in_file ? folder.path() : std::filesystem::path();
  ExportOptions options;
  options.tile_m = 40.0;
  options.grid.emplace();
  export_map(folder.path(), sessions, merge_sessions(sessions, config, {}, {}, nullptr, scratch),
             options);
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path())) {
    if (!entry.is_regular_file() || entry.path().filename() == "timing.json") continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    files[entry.path().lexically_relative(folder.path()).string()] = {
        std::istreambuf_iterator<char>(stream), {}};
  }
  return files;
}

constexpr auto kOneByteEach = [](int) { return std::uint64_t{1}; };

}  // namespace

TEST_CASE("A limited cache keeps what was used last, and what is in use lives on", "[cache]") {
  LimitedCache<int, int> cache(2);
  int made = 0;
  const auto get = [&](int key) {
    return cache.get(
        key, [&](int k) { return ++made, 10 * k; }, kOneByteEach);
  };
  const auto first = get(1);
  CHECK(*get(2) == 20);
  CHECK(*get(1) == 10);
  CHECK(made == 2);
  CHECK(*get(3) == 30);  // 2 was not used for longest
  CHECK(cache.bytes() == 2);
  CHECK(*get(1) == 10);
  CHECK(made == 3);
  CHECK(*get(2) == 20);
  CHECK(made == 4);
  CHECK(*first == 10);
  cache.forget_if([](int key) { return key == 2; });
  CHECK(cache.bytes() == 1);
  get(2);
  CHECK(made == 5);
}

TEST_CASE("What is offered to a limited cache is kept where there is room", "[cache]") {
  LimitedCache<int, int> cache(2);
  int made = 0;
  const auto get = [&](int key) {
    return *cache.get(
        key, [&](int k) { return ++made, 10 * k; }, kOneByteEach);
  };
  get(1);
  cache.offer(1, std::make_shared<const int>(11), 1);
  cache.offer(2, std::make_shared<const int>(22), 1);
  cache.offer(3, std::make_shared<const int>(33), 1);
  CHECK(cache.bytes() == 2);
  CHECK(get(1) == 10);
  CHECK(get(2) == 22);
  CHECK(made == 1);
  CHECK(get(3) == 30);
}

TEST_CASE("A keyframe that was read anyway is not read again", "[cache]") {
  KeyframeRecord keyframe;
  keyframe.sequence = 4;
  keyframe.static_cells.resize(7);
  KeyframeCache cache(1'000'000);
  int times_read = 0;
  const auto contents = cache.contents([&](std::uint32_t) { return ++times_read, keyframe; });
  contents->offer(keyframe);
  CHECK(contents->whole(keyframe)->static_cells.size() == 7);
  CHECK(times_read == 0);
}

TEST_CASE("A value that cannot be made is tried again, and threads make each value once",
          "[cache]") {
  LimitedCache<int, int> cache(1000);
  const auto fail = [](int) -> int { throw std::runtime_error("unreadable"); };
  CHECK_THROWS_WITH(cache.get(1, fail, kOneByteEach), "unreadable");
  std::atomic<int> made{0};
  std::vector<std::thread> threads;
  std::atomic<int> sum{0};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int key = 0; key < 100; ++key) {
        sum += *cache.get(
            key, [&](int k) { return ++made, k; }, kOneByteEach);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(made == 100);
  CHECK(sum == 4 * 4950);
}

TEST_CASE("A merge of keyframes that are read on demand is the same to the byte", "[cache][slow]") {
  const auto town = make_town(1, 2);
  std::vector<SessionData> whole{
      record(town, drive_roads({{0, 0}, {1, 0}, {1, 0.6}}), "a", 11).session,
      record(town, drive_roads({{0.2, 0}, {1, 0}, {1, 0.6}}), "b", 12).session};
  // Planes are found in the cells, and one keyframe has only a summary.
  for (SessionData& session : whole) {
    for (KeyframeRecord& keyframe : session.keyframes) keyframe.planes.clear();
  }
  whole[1].keyframes[2].is_summary = true;
  drop_contents(whole[1].keyframes[2]);
  MergeConfig config;
  config.threads = 1;
  config.loops.max_candidates_per_pair = 12;
  const auto wanted = exported(whole, config);
  REQUIRE(wanted.at("map.ply").size() > 50'000);
  // Room for a few keyframes and clouds.
  config.threads = 3;
  config.memory_mb = 2;
  KeyframeCache cache(config.kept_bytes());
  std::atomic<int> times_read{0};
  const std::vector<SessionData> light{on_demand(whole[0], cache, &times_read),
                                       on_demand(whole[1], cache, &times_read)};
  CHECK((exported(light, config) == wanted));
  CHECK((exported(light, config, true) == wanted));
  CHECK(times_read > static_cast<int>(2 * whole[0].keyframes.size()));
}

TEST_CASE("A keyframe without contents gives their memory back", "[cache]") {
  KeyframeRecord keyframe;
  keyframe.static_cells.resize(1000);
  keyframe.dynamic_cells.resize(1000);
  keyframe.images.resize(2);
  keyframe.images[1].code.resize(1000);
  const std::uint64_t whole = bytes_of(keyframe);
  CHECK(whole > 2000 * sizeof(FineCell) + 1000);
  drop_contents(keyframe);
  CHECK(bytes_of(keyframe) == sizeof(KeyframeRecord));
}

TEST_CASE("Keyframes that are read on demand come levelled", "[cache]") {
  SessionData whole = record(make_town(3, 2), drive_roads({{1, 0.4}, {1, 1}}), "a", 1).session;
  for (std::size_t k = 0; k < whole.keyframes.size(); ++k) {
    KeyframeRecord& keyframe = whole.keyframes[k];
    const bool knows = k + 1 == whole.keyframes.size();
    if (knows) keyframe.up = {true, 1e-6F, 0.0F, 1e-6F};
    const double angle = knows ? 0.0 : 0.1;
    keyframe.T_odometry_keyframe =
        keyframe.T_odometry_keyframe *
        Pose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX())),
             Eigen::Vector3d::Zero());
  }
  KeyframeCache cache(1'000'000);
  SessionData light = on_demand(whole, cache);
  SessionData stored = whole;  // what `light` reads is not levelled
  CHECK(level_keyframes(light) == whole.keyframes.size() - 1);
  CHECK(level_keyframes(stored) == whole.keyframes.size() - 1);
  for (std::size_t k = 0; k < whole.keyframes.size(); ++k) {
    const auto read = whole_keyframe(light, k);
    const KeyframeRecord& levelled = stored.keyframes[k];
    REQUIRE(read->static_cells.size() == levelled.static_cells.size());
    for (std::size_t i = 0; i < levelled.static_cells.size(); ++i) {
      REQUIRE(read->static_cells[i].position == levelled.static_cells[i].position);
    }
    CHECK(read->T_odometry_keyframe.rotation == levelled.T_odometry_keyframe.rotation);
    CHECK(read->keypoints.size() == levelled.keypoints.size());
    CHECK(read->up.known);
  }
}
