// Several workers: the same results as one, to the bit
#include <atomic>
#include <thread>
#include <vector>

#include "robot.hpp"
#include "tests/shuffled.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// Runs parts on threads that it starts for each task: what two parts write at once a thread
/// sanitizer finds.
class Threads {
 public:
  explicit Threads(std::uint32_t workers) : workers_(workers) {}

  [[nodiscard]] Executor executor() { return {run, this, workers_}; }

 private:
  static void run(void* context, std::uint32_t parts, Executor::Part part, void* task) {
    std::atomic<std::uint32_t> next = 0;
    const auto work = [&](std::uint32_t worker) {
      for (std::uint32_t i = next++; i < parts; i = next++) part(task, i, worker);
    };
    std::vector<std::thread> threads;
    for (std::uint32_t worker = 1; worker < static_cast<Threads*>(context)->workers_; ++worker) {
      threads.emplace_back(work, worker);
    }
    work(0);
    for (std::thread& thread : threads) thread.join();
  }

  std::uint32_t workers_;
};

/// Runs the drive with one worker and with several in random order.
Run compare(PipelineConfig config, const Drive& drive, std::initializer_list<std::uint32_t> workers,
            const Way& way = {}) {
  const Run alone = Robot(config, drive, way).run();
  for (const std::uint32_t count : workers) {
    INFO(count << " workers");
    Shuffled shuffled(count, count);
    config.executor = shuffled.executor();
    check_same(alone, Robot(config, drive, way).run());
    CHECK(shuffled.most_parts() > 4);
  }
  return alone;
}

}  // namespace

TEST_CASE("any number of workers gives the same results, in any order of parts", "[executor]") {
  Drive drive;
  drive.scans = 40;
  const Run alone = compare(short_keyframes(5, 4), drive, {2, 3, 4, 8});
  CHECK(alone.keyframes.size() == 8);
  CHECK(alone.relabelled > 4);
}

TEST_CASE("threads give the same results as one worker", "[executor]") {
  PipelineConfig config = short_keyframes(3, 2);
  config.deferred = GENERATE(false, true);
  Drive drive;
  drive.scans = 12;
  const Run alone = Robot(config, drive, {}).run();
  Threads threads(3);
  config.executor = threads.executor();
  check_same(alone, Robot(config, drive, {}).run());
}

TEST_CASE("several workers give the same results with deferred work", "[executor]") {
  PipelineConfig config = short_keyframes(5, 4);
  config.deferred = true;
  Drive drive;
  drive.scans = 30;
  compare(config, drive, {2, 3}, {2, 120, 3});
}

TEST_CASE("deferred work tells of a keyframe in the same call with any number of workers",
          "[executor]") {
  PipelineConfig config = short_keyframes(5, 4);
  config.deferred = true;
  const auto told = [&](const Executor& executor) {
    config.executor = executor;
    OwnedPipeline pipeline(config);
    REQUIRE(pipeline);
    std::vector<int> calls;
    for (std::int64_t i = 0; i < 40; ++i) {
      const TownScan& scan = town_scan(i);
      const ScanResult result =
          pipeline->add_scan(scan.view(), scan.T_odometry_sensor, 1 + i * kPeriodNs);
      calls.push_back(2 * result.keyframe_ready + result.keyframe_finished);
    }
    return calls;
  };
  const std::vector<int> alone = told({});
  CHECK(std::count(alone.begin(), alone.end(), 2) > 4);
  for (const std::uint32_t workers : {2, 4}) {
    Shuffled shuffled(workers, 1);
    CHECK(told(shuffled.executor()) == alone);
  }
}

TEST_CASE("several workers give the same results where containers are full", "[executor][slow]") {
  PipelineConfig config = short_keyframes(5, 4);
  Drive drive;
  drive.scans = 40;
  SECTION("the cells") { config.voxel.max_cells = GENERATE(3000U, 8000U); }
  SECTION("the coarse voxels") { config.voxel.max_voxels = 300; }
  SECTION("the window") {
    config.voxel.max_cells = 1U << 15U;
    config.voxel.max_window_blocks = 9000;
  }
  SECTION("the description") {
    config.descriptor.max_voxels = 200;
    config.descriptor.max_candidates = 130;
  }
  compare(config, drive, {2, 3});
}

TEST_CASE("several workers give the same results with other evidence", "[executor][slow]") {
  PipelineConfig config = short_keyframes(5, 4);
  Drive drive;
  drive.scans = 40;
  SECTION("columns") {
    config.free_space.columns = true;
    config.free_space.visibility = false;
  }
  SECTION("no components") { config.removal.components = false; }
  compare(config, drive, {2});
}

TEST_CASE("a further worker takes a fifth of a megabyte", "[executor]") {
  PipelineConfig config = short_keyframes(5, 4);
  const std::size_t alone = Pipeline::required_bytes(config);
  Shuffled shuffled(3, 1);
  config.executor = shuffled.executor();
  const std::size_t bytes = (Pipeline::required_bytes(config) - alone) / 2;
  CHECK(bytes > 150'000);
  CHECK(bytes < 210'000);
}
