// Deferred work: the same results as without delay
#include "deferred.hpp"

#include "stream_checksum.hpp"
#include "tests/test.hpp"
#include "unimapper/onboard/events.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// Checksums of all that is said of a keyframe.
struct Said {
  std::uint64_t view = 0;    ///< poses, cells and images
  std::uint64_t labels = 0;  ///< online ones
  std::uint64_t place = 0;   ///< keypoints and planes
  std::uint64_t loops = 0;
  std::uint64_t evicted = 0;  ///< counts of the keyframe it evicted, and that one's final labels
  std::uint64_t counts = 0;   ///< statistics but for times
};

using Event = std::tuple<std::uint32_t, std::int64_t, std::vector<std::int64_t>>;

/// All that a run says.
struct Run {
  std::map<std::uint32_t, Said> keyframes;
  std::vector<std::uint64_t> last_labels;  ///< final ones, of the keyframes left in the window
  std::vector<Event> events;               ///< sorted: deferred ones come later
  std::uint32_t late_slices = 0;
  std::uint32_t relabelled = 0;  ///< keyframes
  std::uint32_t loops = 0;
};

/// Scan `i` of the town, simulated once for all runs.
const TownScan& town_scan(std::int64_t i) {
  static const IntegerTown town({});
  static std::vector<TownScan> scans;
  while (std::ssize(scans) <= i) scans.push_back(town.scan(std::ssize(scans)));
  return scans[static_cast<std::size_t>(i)];
}

/// What happens on a drive beside its scans.
struct Drive {
  std::int64_t scans = 60;
  std::vector<std::int64_t> flushes;          ///< before these scans
  std::vector<std::int64_t> glitches;         ///< scans whose pose is far off
  std::vector<std::int64_t> empty;            ///< scans without points
  std::vector<std::int64_t> late;             ///< scans that repeat the stamp before
  std::vector<std::int64_t> place_insertion;  ///< of earlier runs, before these scans
  std::int64_t restart = 1000;                ///< from this scan on the odometry starts anew
};

bool holds(const std::vector<std::int64_t>& list, std::int64_t i) {
  return std::find(list.begin(), list.end(), i) != list.end();
}

/// How the slices are spread.
struct Way {
  std::uint32_t work_seed = 0;  ///< of the calls of `work`; 0: none
  std::uint32_t budget_us = 0;  ///< by a clock that advances by 4 whenever it is read
  std::uint32_t waiting_scans = 10;
};

class Robot {
 public:
  Robot(PipelineConfig config, const Drive& drive, const Way& way)
      : drive_(drive), random_(way.work_seed), works_(way.work_seed != 0) {
    alignas(64) static std::byte memory[EventRing::required_bytes(8192)];
    ring_ = EventRing::create(8192, memory).value();
    config.events = ring_;
    if (works_ || way.budget_us > 0) config.clock_ns = fake_clock;
    config.budget_us = way.budget_us;
    config.waiting_scans = way.waiting_scans;
    pipeline_.emplace(config);
    REQUIRE(*pipeline_);
  }

  Run run() {
    for (std::int64_t i = 0; i < drive_.scans; ++i) {
      if (holds(drive_.flushes, i)) flush();
      if (holds(drive_.place_insertion, i)) insert_place();
      scans_.push_back(town_scan(i));
      TownScan& scan = scans_.back();
      if (holds(drive_.empty, i)) scan.xyz.clear();
      if (holds(drive_.glitches, i)) scan.T_odometry_sensor.translation.x() += 90.0;
      if (i >= drive_.restart) scan.T_odometry_sensor.translation.y() -= 400.0;
      const std::int64_t stamp_ns = 1 + (holds(drive_.late, i) ? i - 1 : i) * kPeriodNs;
      handle(pipeline()->add_scan(scan.view(), scan.T_odometry_sensor, stamp_ns));
      work();
    }
    flush();
    while (pipeline()->relabel_next()) {
      run_.last_labels.push_back(checksum(
          [&](Fnv1a& sum) { add_evicted(pipeline()->finished_keyframe().relabelled, sum); }));
    }
    EventRecord event;
    while (ring_->pop(event)) {
      if (event.id == static_cast<std::uint32_t>(EventId::kDeadlineMissed)) continue;
      run_.events.emplace_back(event.id, event.stamp_ns,
                               std::vector<std::int64_t>(event.values, event.values + 4));
    }
    std::sort(run_.events.begin(), run_.events.end());
    return run_;
  }

 private:
  OwnedPipeline& pipeline() { return *pipeline_; }

  /// Now and then, some.
  void work() {
    while (works_ && next(3) == 0) {
      const WorkResult result = pipeline()->work(next(2) * next(40));
      handle({{}, result.keyframe_ready, result.keyframe_finished});
    }
  }

  void flush() {
    ScanResult result;
    do {
      result = pipeline()->flush();
      handle(result);
    } while (result.keyframe_ready || result.keyframe_finished);
  }

  /// The one that was described last, as if of an earlier run.
  void insert_place() {
    flush();
    PlaceDatabase& places = pipeline()->places();
    const KeyframeView& view = pipeline()->finished_keyframe();
    places.insert(view.place, {7, view.sequence}, view.T_odometry_keyframe);
  }

  void handle(const ScanResult& result) {
    if (result.keyframe_finished && !result.keyframe_ready) add_finished();
    if (!result.keyframe_ready) return;
    // Final labels of the keyframe before can still be applied, and its view still holds.
    const bool together =
        pipeline()->keyframe().sequence == pipeline()->finished_keyframe().sequence;
    if (result.keyframe_finished && !together) add_finished();
    add_labels();
    if (result.keyframe_finished && together) add_finished();
  }

  void add_labels() {
    const KeyframeView& view = pipeline()->keyframe();
    Fnv1a sum;
    std::vector<PointLabel> labels;
    for (std::size_t s = 0; s < view.scans.size(); ++s) {
      const std::size_t scan = view.scans[s].scan_index;
      labels.resize(scans_.at(scan).xyz.size() / 3);
      REQUIRE(pipeline()->labels(s, labels) == labels.size());
      for (const PointLabel label : labels) sum.add(label);
      labels_[view.sequence].push_back({scan, labels});
    }
    REQUIRE(run_.keyframes.count(view.sequence) == 0);
    run_.keyframes[view.sequence].labels = sum.value();
  }

  void add_evicted(const RelabelledKeyframe& relabelled, Fnv1a& sum) {
    sum.add(relabelled.available);
    if (!relabelled.available) return;
    ++run_.relabelled;
    for (const std::uint32_t count : {relabelled.sequence, relabelled.later_keyframes,
                                      relabelled.cells_now_dynamic, relabelled.cells_now_static}) {
      sum.add(count);
    }
    REQUIRE(labels_.count(relabelled.sequence) == 1);
    for (auto& [scan, labels] : labels_[relabelled.sequence]) {
      const TownScan& points = scans_.at(scan);
      sum.add(pipeline()->relabel(points.view(), points.T_odometry_sensor, labels));
      for (const PointLabel label : labels) sum.add(label);
    }
  }

  void add_finished() {
    const KeyframeView& view = pipeline()->finished_keyframe();
    REQUIRE(run_.keyframes.count(view.sequence) == 1);
    Said& said = run_.keyframes[view.sequence];
    REQUIRE(said.view == 0);
    said.view = checksum([&](Fnv1a& sum) {
      add_poses(view, sum);
      add_cells(view.static_cells, sum);
      add_cells(view.dynamic_cells, sum);
      sum.add(view.points_in);
      sum.add(view.points_dynamic);
      sum.add(view.image_full_weight_range_m);
      for (const FreeSpaceImage& image : view.images) {
        sum.add(image.scan);
        for (const std::uint16_t pixel : image.pixels) sum.add(pixel);
      }
    });
    said.place = checksum([&](Fnv1a& sum) {
      add_keypoints(view.place.keypoints, sum);
      add_planes(view.place.planes, sum);
      sum.add(view.place.up.known);
    });
    said.loops = checksum([&](Fnv1a& sum) {
      add_loops(view.loops, sum);
      for (const LoopCandidate& loop : view.loops) sum.add(loop.query.keyframe);
    });
    run_.loops += static_cast<std::uint32_t>(view.loops.size());
    said.evicted = checksum([&](Fnv1a& sum) { add_evicted(view.relabelled, sum); });
    said.counts = checksum([&](Fnv1a& sum) {
      const KeyframeStatistics& statistics = *view.statistics;
      add_counts(statistics, sum);
      for (const std::uint32_t count : {statistics.walls, statistics.aligned_scans}) sum.add(count);
      for (const CapacityUse& use : statistics.capacity) sum.add(use);
      sum.add(statistics.odometry_tilt_deg);
    });
    run_.late_slices += view.statistics->late_slices;
  }

  template <typename Add>
  static std::uint64_t checksum(const Add& add) {
    Fnv1a sum;
    add(sum);
    return sum.value();
  }

  std::uint32_t next(std::uint32_t below) {
    random_ = random_ * 1664525U + 1013904223U;
    return (random_ >> 16U) % below;
  }

  Drive drive_;
  std::uint32_t random_;
  bool works_;
  EventRing* ring_ = nullptr;
  std::optional<OwnedPipeline> pipeline_;
  std::vector<TownScan> scans_;
  struct Labelled {
    std::size_t scan;
    std::vector<PointLabel> labels;
  };
  std::map<std::uint32_t, std::vector<Labelled>> labels_;
  Run run_;
};

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
    const Run& plain = runs.front();
    const Run& deferred = runs.back();
    REQUIRE(plain.keyframes.size() == deferred.keyframes.size());
    for (const auto& [sequence, said] : plain.keyframes) {
      INFO("keyframe " << sequence);
      const Said& then = deferred.keyframes.at(sequence);
      CHECK(said.view == then.view);
      CHECK(said.labels == then.labels);
      CHECK(said.place == then.place);
      CHECK(said.loops == then.loops);
      CHECK(said.evicted == then.evicted);
      CHECK(said.counts == then.counts);
    }
    CHECK(plain.last_labels == deferred.last_labels);
    CHECK(plain.events == deferred.events);
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
