#include "src/apps/onboard/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <stdexcept>
#include <thread>

#include "ports/linux/allocation_counter.hpp"

namespace unimapper::apps {

namespace {

/// Room for whatever keyframe a pipeline makes.
wire::KeyframeRoom room_for(const PipelineConfig& config) {
  const FreeSpaceConfig& free_space = config.free_space;
  const std::size_t pixels = ImageProjection(free_space.image_shape()).pixels();
  return {config.keyframe.scans, config.voxel.max_cells, config.descriptor.max_keypoints,
          free_space.images_per_keyframe,
          std::max<std::size_t>(pixels, free_space.max_image_pixels)};
}

}  // namespace

Replay::Replay(const datasets::Dataset& dataset, Pipeline& pipeline, const ReplayOptions& options,
               ReplayOutputs outputs)
    : dataset_(dataset),
      pipeline_(pipeline),
      options_(options),
      outputs_(outputs),
      intensity_(pipeline.config().intensity ? datasets::IntensityScale(dataset)
                                             : datasets::IntensityScale()),
      // Faster than real time, encoding may be waited for; in real time it must not.
      encoding_(options.session,
                {.room = room_for(pipeline.config()), .drop_when_full = options.realtime},
                [this](wire::EncodedKeyframe keyframe) { take(std::move(keyframe)); }) {}

void Replay::run() {
  start_ = std::chrono::steady_clock::now();
  for (std::size_t i = options_.first; i < options_.end; ++i) feed(i);
  ScanResult last;
  do {
    {
      const linux_port::AllocationGuard guard;
      last = pipeline_.flush();
    }
    share(last, false);
    handle(last);
  } while (last.keyframe_ready || last.keyframe_finished);
  finish_labels();
  finish_encoding();
  allocations_ = linux_port::AllocationGuard::count();
}

void Replay::feed(std::size_t index) {
  dataset_.read_scan(index, scan_);
  points_.push_back(scan_.points.size());
  PointView points = scan_.view();
  if (pipeline_.config().intensity) {
    const auto intensities = intensity_.bytes(scan_);
    if (!intensities.empty()) points.intensities = intensities.data();
  }
  if (repeats_.add(scan_.fingerprint, dataset_.pose(index))) {
    repeated_.push_back(index);
    points.count = 0;
  }
  if (options_.realtime) std::this_thread::sleep_until(due(index));
  ScanResult result;
  const auto called = std::chrono::steady_clock::now();
  {
    const linux_port::AllocationGuard guard;
    (void)pipeline_.add_slip(dataset_.slip(index));  // of the own odometry: always one
    result = pipeline_.add_scan(points, dataset_.pose(index), dataset_.stamp_ns(index));
  }
  const auto returned = std::chrono::steady_clock::now();
  if (result.keyframe_ready) {
    const std::chrono::nanoseconds elapsed = returned - called;
    outputs_.statistics.add_closing_call(elapsed.count(),
                                         options_.realtime && returned > due(index + 1));
  }
  share(result, true);
  outputs_.statistics.add_scan(points.count, result.error);
  // A jump of the pose closes the keyframe before it, and the scan itself is refused.
  if (result.error.code != ErrorCode::kOk) {
    const bool is_left_out = !repeated_.empty() && repeated_.back() == index;
    report_refusal(index, is_left_out ? "it repeats the one before" : result.error.message);
  }
  handle(result);
  outputs_.progress.update(index + 1, std::to_string(outputs_.statistics.keyframes()) +
                                          " keyframes, " + std::to_string(loops_.size()) +
                                          " loops");
}

void Replay::share(const ScanResult& result, bool is_scan) {
  if (outputs_.share == nullptr) return;
  {
    const linux_port::AllocationGuard guard;
    if (is_scan) {
      outputs_.share->after_scan(pipeline_, result);
    } else {
      outputs_.share->after_flush(pipeline_, result);
    }
  }
  if (result.keyframe_finished) outputs_.share->reclaim();
}

std::chrono::steady_clock::time_point Replay::due(std::size_t index) const {
  if (index >= options_.end) return std::chrono::steady_clock::time_point::max();
  const std::int64_t since_start_ns = dataset_.stamp_ns(index) - dataset_.stamp_ns(options_.first);
  return start_ + std::chrono::nanoseconds(since_start_ns);
}

void Replay::report_refusal(std::size_t index, const std::string& reason) {
  // Every input scan gets its labels: without a decision all points count as static.
  outputs_.folder.write_labels(dataset_.scan_name(index), {}, points_of(index));
  if (options_.final_labels) {
    outputs_.folder.write_final_labels(dataset_.scan_name(index), {}, points_of(index));
  }
  constexpr std::uint64_t kMaxNotes = 10;
  const std::uint64_t refused = outputs_.statistics.scans_refused();
  if (refused > kMaxNotes) return;
  outputs_.progress.note("scan " + dataset_.scan_name(index) + " refused: " + reason +
                         (refused == kMaxNotes ? " (further refusals only in stats.json)" : ""));
}

void Replay::handle(const ScanResult& result) {
  if (result.keyframe_ready) {
    const KeyframeView& keyframe = pipeline_.keyframe();
    if (keyframe.repeats) outputs_.statistics.add_repeat(*keyframe.statistics);
    collect_labels(keyframe);
  }
  if (result.keyframe_finished) collect_keyframe();
}

void Replay::collect_keyframe() {
  KeyframeView keyframe = pipeline_.finished_keyframe();
  scans_.assign(keyframe.scans.begin(), keyframe.scans.end());
  for (KeyframeScan& scan : scans_) {
    scan.scan_index = static_cast<std::uint32_t>(in_recording(scan.scan_index));
  }
  keyframe.scans = scans_;
  collect_final_labels(keyframe.relabelled);
  outputs_.known.add(keyframe);
  collect_loops(keyframe);
  send(keyframe);
  outputs_.statistics.add_keyframe(keyframe, duration_ns(keyframe));
  warn_of_full_cells(*keyframe.statistics);
  if (!outputs_.delivery.is_published()) return;
  publish_health();
  if (const std::string news = outputs_.delivery.map_pose_news(); !news.empty()) {
    outputs_.progress.note(news);
  }
}

void Replay::warn_of_full_cells(const KeyframeStatistics& statistics) {
  const std::uint64_t points = statistics.dropped_by(DropCause::kCellsFull);
  if (points == 0 || warned_of_full_cells_) return;
  warned_of_full_cells_ = true;
  const PipelineConfig& config = pipeline_.config();
  const std::string text = fmt::format(
      "warning: no room for more fine cells (at most {}), {} points of this keyframe stay static "
      "unseen: lower "
      "keyframe.range_max_m ({:.0f}) or raise voxel.max_cells (--config), or choose a larger "
      "--preset",
      config.voxel.max_cells, points, config.keyframe.range_max_m);
  outputs_.progress.note(text);
}

void Replay::collect_labels(const KeyframeView& keyframe) {
  for (std::size_t i = 0; i < keyframe.scans.size(); ++i) {
    const std::size_t index = in_recording(keyframe.scans[i].scan_index);
    labels_.resize(points_of(index));
    const std::size_t count = pipeline_.labels(i, labels_);
    outputs_.folder.write_labels(dataset_.scan_name(index), std::span(labels_).first(count),
                                 labels_.size());
    if (!options_.final_labels) continue;
    if (keyframe.repeats) {
      outputs_.folder.write_final_labels(dataset_.scan_name(index), std::span(labels_).first(count),
                                         labels_.size());
      continue;
    }
    std::vector<PointLabel> kept(labels_.begin(),
                                 labels_.begin() + static_cast<std::ptrdiff_t>(count));
    open_scans_.push_back({keyframe.sequence, index, std::move(kept)});
  }
}

void Replay::collect_final_labels(const RelabelledKeyframe& relabelled) {
  if (!relabelled.available) return;
  outputs_.statistics.add_relabelled(relabelled);
  if (!options_.final_labels) return;
  while (!open_scans_.empty() && open_scans_.front().keyframe <= relabelled.sequence) {
    OpenScan& open = open_scans_.front();
    if (open.keyframe == relabelled.sequence) {
      dataset_.read_scan(open.index, earlier_scan_);
      pipeline_.relabel(earlier_scan_.view(), dataset_.pose(open.index), open.labels);
    }
    outputs_.folder.write_final_labels(dataset_.scan_name(open.index), open.labels,
                                       points_of(open.index));
    open_scans_.pop_front();
  }
}

void Replay::finish_labels() {
  while (pipeline_.relabel_next()) collect_final_labels(pipeline_.finished_keyframe().relabelled);
  // Keyframes that were evicted early keep their online labels.
  for (const OpenScan& open : open_scans_) {
    outputs_.folder.write_final_labels(dataset_.scan_name(open.index), open.labels,
                                       points_of(open.index));
  }
  open_scans_.clear();
}

void Replay::collect_loops(const KeyframeView& keyframe) {
  std::size_t accepted = 0;
  for (const LoopCandidate& candidate : keyframe.loops) {
    accepted += candidate.accepted ? 1 : 0;
    if (candidate.accepted || options_.all_candidates) {
      loops_.push_back(outputs_.known.record(candidate));
    }
  }
  outputs_.statistics.add_loops(keyframe.loops.size(), accepted);
}

void Replay::send(const KeyframeView& keyframe) {
  const auto called = std::chrono::steady_clock::now();
  {
    const linux_port::AllocationGuard guard;
    (void)encoding_.hand_over(keyframe);
  }
  const std::chrono::nanoseconds elapsed = std::chrono::steady_clock::now() - called;
  outputs_.statistics.add_hand_over(elapsed.count());
  encoding_.rethrow();
}

void Replay::take(wire::EncodedKeyframe keyframe) {
  if (outputs_.signer != nullptr) outputs_.signer->sign(keyframe.bytes);
  // First to the spool, whose keyframes outlive a process that is killed now.
  outputs_.delivery.take(keyframe);
  outputs_.folder.failures().attempt([this, &keyframe] { outputs_.log.write(keyframe); });
}

void Replay::finish_encoding() {
  const lcm_port::EncodingCounters counters = encoding_.finish();
  outputs_.statistics.add_encoding(counters);
  if (counters.encoded == counters.handed_over) return;
  outputs_.progress.note("warning: " + std::to_string(counters.dropped) +
                         " keyframes came faster than they were encoded and were dropped, " +
                         std::to_string(counters.refused) + " could not be encoded");
}

void Replay::publish_health() {
  const RunStatistics& statistics = outputs_.statistics;
  wire::HealthMessage health;
  health.scans = statistics.scans();
  health.keyframes = statistics.keyframes();
  health.points_in = statistics.points_in();
  for (std::size_t i = 0; i < kStages; ++i) {
    const auto stage = static_cast<Stage>(i);
    const StageTimes times = statistics.stage_times(stage);
    health.stages.push_back(
        {std::string(stage_name(stage)), times.p50_ms, times.p99_ms, times.max_ms});
  }
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    const auto cause = static_cast<DropCause>(i);
    health.drops.push_back({std::string(drop_cause_name(cause)), statistics.dropped(cause)});
  }
  health.deadline_misses = statistics.deadline_misses();
  for (std::size_t i = 0; i < kCapacities; ++i) {
    const auto capacity = static_cast<Capacity>(i);
    const CapacityUse& use = statistics.largest_use(capacity);
    health.containers.push_back({std::string(capacity_name(capacity)), use.used, use.capacity});
  }
  outputs_.delivery.set_health(std::move(health));
}

std::int64_t Replay::duration_ns(const KeyframeView& keyframe) const {
  const auto count = static_cast<std::int64_t>(keyframe.scans.size());
  const std::int64_t span_ns = keyframe.scans.back().stamp_ns - keyframe.scans.front().stamp_ns;
  // n scans cover n periods, but n stamps only n - 1.
  if (count > 1) return span_ns / (count - 1) * count;
  const std::size_t index = keyframe.scans.front().scan_index;
  const std::size_t other = index > 0 ? index - 1 : std::min<std::size_t>(1, options_.end - 1);
  return std::abs(dataset_.stamp_ns(index) - dataset_.stamp_ns(other));
}

}  // namespace unimapper::apps
