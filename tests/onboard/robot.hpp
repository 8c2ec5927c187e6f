// Drives of a robot, and checksums of all that the pipeline says of them
#pragma once

#include "deferred.hpp"
#include "stream_checksum.hpp"
#include "unimapper/onboard/events.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::test {

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
inline const TownScan& town_scan(std::int64_t i) {
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

inline bool holds(const std::vector<std::int64_t>& list, std::int64_t i) {
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

/// Two runs said the same of everything.
inline void check_same(const Run& plain, const Run& other) {
  REQUIRE(plain.keyframes.size() == other.keyframes.size());
  for (const auto& [sequence, said] : plain.keyframes) {
    INFO("keyframe " << sequence);
    const Said& then = other.keyframes.at(sequence);
    CHECK(said.view == then.view);
    CHECK(said.labels == then.labels);
    CHECK(said.place == then.place);
    CHECK(said.loops == then.loops);
    CHECK(said.evicted == then.evicted);
    CHECK(said.counts == then.counts);
  }
  CHECK(plain.last_labels == other.last_labels);
  CHECK(plain.events == other.events);
}

}  // namespace unimapper::test
