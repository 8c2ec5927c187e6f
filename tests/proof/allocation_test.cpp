// Proof that the pipeline, the encoder of its keyframes and the odometry allocate nothing after
// construction.
#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "ports/linux/allocation_counter.hpp"
#include "tests/odometry/scene.hpp"
#include "tests/proof/runs.hpp"
#include "tests/proof/watched_workers.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::test;
using linux_port::AllocationGuard;

/// Counts the allocations of a part on a worker thread.
struct CountedPart {
  static inline std::atomic<std::uint64_t> allocations = 0;
  std::uint64_t before = AllocationGuard::count();
  AllocationGuard guard;
  ~CountedPart() { allocations += AllocationGuard::count() - before; }
};

/// Allocations of what the robot would run; scans are made before.
std::uint64_t count_run(const PipelineConfig& config, const std::vector<LabelledScan>& scans,
                        unsigned& keyframes) {
  OwnedPipeline pipeline(config);
  Encoding encoding(config);
  std::vector<PointLabel> labels(100000);
  const std::uint64_t before = AllocationGuard::count();
  const AllocationGuard guard;
  std::int64_t stamp = 0;
  const auto count_finished = [&](bool finished) {
    if (finished && encoding.encode(pipeline->finished_keyframe())) ++keyframes;
  };
  // Calls that refuse their scan finish keyframes, too, where that is deferred.
  const auto add = [&](const PointView& points, const Pose& pose, std::int64_t stamp_ns) {
    const ScanResult result = pipeline->add_scan(points, pose, stamp_ns);
    if (result.keyframe_ready) read_labels(pipeline, labels);
    count_finished(result.keyframe_finished);
  };
  for (const LabelledScan& scan : scans) {
    // Every refusal occurs: time, pose, jump, no valid point.
    add(scan.view(), sensor_at(0, 0), -1);
    add(scan.view(), sensor_at(1e12, 0), stamp + 1);
    add(PointView{}, sensor_at(0, 0), stamp + 1);
    ++stamp;
    add(scan.view(), sensor_at(0.1 * static_cast<double>(keyframes), 0), stamp);
    count_finished(pipeline->work(500).keyframe_finished);
  }
  add(scans.front().view(), sensor_at(500.0, 0), ++stamp);
  ScanResult last;
  do {
    last = pipeline->flush();
    count_finished(last.keyframe_finished);
  } while (last.keyframe_finished);
  return AllocationGuard::count() - before + CountedPart::allocations;
}

/// Allocations of an odometry that tracks, is lost and begins its map anew; scans are made before.
std::uint64_t count_odometry(std::uint32_t& restarts) {
  std::vector<SweptScan> scans;
  for (int i = 0; i < 4; ++i) {
    scans.push_back(sweep(hall(), [&](double t) { return level(2.0 * (0.1 * i + t), 0.0, 0.1); }));
  }
  for (int i = 0; i < 8; ++i) scans.push_back(snapshot(elsewhere(), level(0.2 * i, 0.0, 0.0)));
  TestOdometry odometry;
  const std::uint64_t before = AllocationGuard::count();
  const AllocationGuard guard;
  for (const SweptScan& scan : scans) {
    odometry.pass(scan);
    static_cast<void>(odometry->add_scan(-1, scan.view(), {}));
  }
  restarts = odometry->statistics().restarts;
  return AllocationGuard::count() - before;
}

}  // namespace

int main() {
  {
    const AllocationGuard guard;
    void* volatile block = std::malloc(10);  // volatile: or it would be left out
    std::free(block);
    int* volatile number = new int(3);
    delete number;
  }
  if (AllocationGuard::count() != 2) {
    std::puts("the counter itself does not count");
    return 1;
  }

  const std::vector<LabelledScan> scans = scans_of_street(45);

  PipelineConfig both = small_config();
  both.free_space.columns = true;
  PipelineConfig thinned = small_config();
  thinned.keyframe.downsample_leaf_m = 0.1F;
  PipelineConfig tight = small_config();
  tight.voxel.max_cells = 1000;
  tight.voxel.max_voxels = 50;
  // A budget that is sometimes kept and sometimes not, and a ring that overflows.
  alignas(64) static std::byte ring[EventRing::required_bytes(4)];
  PipelineConfig hurried = small_config();
  hurried.budget_us = 3000;
  hurried.clock_ns = +[] {
    static std::int64_t now_ns = 0;
    return now_ns += 300000;
  };
  hurried.events = EventRing::create(4, ring).value();
  PipelineConfig deferred = hurried;
  deferred.deferred = true;
  deferred.waiting_scans = 3;  // which is full now and then
  WatchedWorkers<CountedPart> workers(2);
  PipelineConfig helped = both;
  helped.executor = workers.executor();
  PipelineConfig helped_later = deferred;
  helped_later.executor = workers.executor();
  for (const PipelineConfig& config :
       {both, thinned, tight, hurried, deferred, helped, helped_later}) {
    unsigned keyframes = 0;
    const std::uint64_t counted = count_run(config, scans, keyframes);
    std::printf("%llu allocations in %u keyframes\n", static_cast<unsigned long long>(counted),
                keyframes);
    if (counted != 0 || keyframes < 4) return 1;
  }
  std::printf("%llu parts on a second thread\n",
              static_cast<unsigned long long>(workers.counts().parts_by_threads));
  std::uint32_t restarts = 0;
  const std::uint64_t counted = count_odometry(restarts);
  std::printf("%llu allocations of the odometry\n", static_cast<unsigned long long>(counted));
  if (counted != 0 || restarts != 1) return 1;
  return 0;
}
