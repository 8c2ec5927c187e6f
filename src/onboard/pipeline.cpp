#include "unimapper/onboard/pipeline.hpp"

#include <algorithm>
#include <cstdint>
#include <new>
#include <utility>

#include "budget.hpp"
#include "dynamic_removal.hpp"
#include "event_reporter.hpp"
#include "evidence_window.hpp"
#include "gravity.hpp"
#include "gravity_planes.hpp"
#include "keyframe.hpp"
#include "keyframe_builder.hpp"
#include "keyframe_finisher.hpp"
#include "keyframe_output.hpp"
#include "motion_gate.hpp"
#include "stage_clock.hpp"
#include "unimapper/core/angles.hpp"

namespace unimapper {

using namespace onboard;

/// Everything the pipeline owns: one member per stage, in the order the data takes.
struct Pipeline::State {
  explicit State(const PipelineConfig& configuration) noexcept
      : config(configuration),
        gate(configuration.keyframe),
        budget(configuration),
        builder(configuration),
        removal(config),
        gravity(configuration.odometry),
        finisher(config),
        events(configuration) {}

  void allocate(Arena& arena) noexcept;

  ScanResult add_scan(const PointView& points, const Pose& pose, std::int64_t stamp_ns) noexcept;
  /// The same without the work that was deferred.
  ScanResult take_scan(const PointView& points, const Pose& pose, std::int64_t stamp_ns) noexcept;
  ScanResult flush() noexcept;
  WorkResult work(std::uint32_t budget_us) noexcept;

  void forget() noexcept;
  void close_keyframe() noexcept;
  void remove_dynamic() noexcept;
  /// Where the keyframe that is closing was seen from.
  [[nodiscard]] Viewpoint viewpoint() const noexcept;
  /// Looks for up among what is static, and levels the keyframe's frame by it.
  void find_up() noexcept;
  /// Writes down what is known of the keyframe but its place.
  void write_view() noexcept;
  void count_points() noexcept;

  /// Deferred work: a slice, this call's share, all of it, all of it before the next keyframe
  /// closes.
  void do_slice() noexcept;
  void do_share() noexcept;
  void finish() noexcept;
  void finish_late() noexcept;
  void tell_finished() noexcept;
  /// What is relabelled in slices reads the window's occupancy before that is gone.
  static void finish_labels(void* state) noexcept {
    static_cast<State*>(state)->finisher.labels().finish(static_cast<State*>(state)->window);
  }
  /// Whether a keyframe was finished since the last time this was asked.
  [[nodiscard]] bool take_finished() noexcept { return std::exchange(finished_untold, false); }

  PipelineConfig config;
  Pipeline pipeline;  ///< what the caller holds

  MotionGate gate;
  Budget budget;
  KeyframeBuilder builder;
  EvidenceWindow window;
  DynamicRemoval removal;
  GravityPlanes gravity_planes;
  GravityEstimator gravity;
  KeyframeOutput output;
  KeyframeFinisher finisher;
  EventReporter events;

  std::uint32_t scan_index = 0;
  std::uint32_t sequence = 0;
  Keyframe keyframes[2];
  Keyframe* current = &keyframes[0];   ///< the open one, or the one that the next scan begins
  Keyframe* closed = &keyframes[1];    ///< the last one that was closed
  Keyframe* finished = &keyframes[1];  ///< the last one that was finished
  bool finished_untold = false;        ///< the caller does not know of it yet
};

void Pipeline::State::allocate(Arena& arena) noexcept {
  builder.allocate(arena, config);
  removal.allocate(arena);
  finisher.allocate(arena);
  // Nothing reads the sums of the cells once they lie in the table, and nothing the table once
  // the rest of a keyframe is begun, which is finished before the next table is built.
  arena.share([&] { builder.allocate_cells(arena, config); },
              [&] { removal.allocate_scratch(arena); });
  arena.share([&] { removal.allocate_table(arena); }, [&] { finisher.allocate_scratch(arena); });
  window.allocate(arena, config);
  gravity_planes.allocate(arena);
  output.allocate(arena, config);
  window.blocks().before_early_eviction(finish_labels, this);
}

// ---------------------------------------------------------------------------------------------
// Scans to keyframes

ScanResult Pipeline::State::add_scan(const PointView& points, const Pose& pose,
                                     std::int64_t stamp_ns) noexcept {
  ScanResult result = take_scan(points, pose, stamp_ns);
  if (!result.keyframe_ready) do_share();
  result.keyframe_finished = take_finished();
  return result;
}

ScanResult Pipeline::State::take_scan(const PointView& points, const Pose& pose,
                                      std::int64_t stamp_ns) noexcept {
  const StageTimer timer(config.clock_ns, current->statistics, Stage::kTotal);
  budget.start();
  const std::uint32_t index = scan_index++;
  const auto refuse = [&](const Error& error, bool closes) -> ScanResult {
    events.refusal(error, stamp_ns, index);
    if (closes) close_keyframe();
    return {error, closes, false};
  };
  const Motion motion = gate.check(pose, stamp_ns);
  if (motion.error.code != ErrorCode::kOk) {
    return refuse(motion.error, motion.error.code == ErrorCode::kPoseJump && builder.is_open());
  }
  // Two poses in a row say that the robot is elsewhere: whatever was seen before is of no use.
  if (motion.restarted) forget();
  if (!builder.add(points, {index, stamp_ns, pose}, window, *current)) {
    return refuse({ErrorCode::kEmptyScan,
                   "the scan has no point that is finite and within the sensor's range"},
                  false);
  }
  gate.accept(pose, stamp_ns);
  if (!builder.is_complete(*current)) return {};
  close_keyframe();
  return {{}, true, false};
}

void Pipeline::State::forget() noexcept {
  window.forget();
  finisher.forget();
  gravity.forget();
  builder.forget();
}

ScanResult Pipeline::State::flush() noexcept {
  ScanResult result;
  if (builder.is_open()) {
    const StageTimer timer(config.clock_ns, current->statistics, Stage::kTotal);
    budget.start();
    close_keyframe();
    result.keyframe_ready = true;
  }
  // One keyframe at a time: the caller must see the one before first.
  if (!finished_untold) finish();
  result.keyframe_finished = take_finished();
  return result;
}

/// The order of everything.
void Pipeline::State::close_keyframe() noexcept {
  finish_late();
  current->view = {};
  current->view.sequence = sequence++;
  builder.close(*current);
  remove_dynamic();
  finisher.begin(*current);
  if (!config.deferred) finisher.finish_now(budget);
  budget.measure(Budget::Part::kCounting, 1, [this] { count_points(); });
  current->statistics.deadline_missed = budget.is_exceeded();
  current->spent_us = budget.spent_us();
  events.closed(*current);
  closed = std::exchange(current, closed);
  if (!config.deferred) tell_finished();
}

void Pipeline::State::remove_dynamic() noexcept {
  const StageTimer timer(config.clock_ns, current->statistics, Stage::kRemoval);
  const Viewpoint from = viewpoint();
  removal.weigh(builder.scans(), from, window, budget);
  budget.measure(Budget::Part::kClassifying, 1, [&] {
    removal.classify(window.blocks(), from);
    finisher.begin_labels(window, removal.cells(), finished_untold, *current);
    find_up();
    output.build(window.blocks(), removal.cells(), removal.voxels(),
                 current->view.T_odometry_keyframe);
    window.record(removal.cells());
  });
  write_view();
}

Viewpoint Pipeline::State::viewpoint() const noexcept {
  const Eigen::Vector3d& sensor = current->view.T_odometry_keyframe.translation;
  return {(sensor - builder.scans().grid().origin_m()).cast<float>(), builder.ray_spacing_deg()};
}

void Pipeline::State::find_up() noexcept {
  const GravityScene scene = gravity_planes.collect(removal.cells(), removal.voxels());
  const UpEstimate& estimate = gravity.add(scene);
  KeyframeStatistics& statistics = current->statistics;
  KeyframeView& view = current->view;
  statistics.walls = static_cast<std::uint32_t>(scene.walls.size());
  statistics.up_known = estimate.known;
  statistics.up_contradicted = estimate.contradicted;
  if (!estimate.known) return;
  Pose& frame = view.T_odometry_keyframe;
  frame = level_frame(view.scans[view.reference_scan].T_odometry_sensor, estimate.up);
  const Eigen::Matrix3d covariance =
      frame.rotation.transpose() * estimate.covariance * frame.rotation;
  view.up = {true, static_cast<float>(covariance(0, 0)), static_cast<float>(covariance(0, 1)),
             static_cast<float>(covariance(1, 1))};
  const auto level = static_cast<float>(estimate.up.head<2>().norm());
  statistics.odometry_tilt_deg =
      360.0F * direction_turns(static_cast<float>(estimate.up.z()), level);
}

// ---------------------------------------------------------------------------------------------
// Work that was deferred

void Pipeline::State::do_slice() noexcept {
  if (finisher.is_busy() && !finisher.step(window)) tell_finished();
}

void Pipeline::State::finish() noexcept {
  while (finisher.is_busy()) do_slice();
}

void Pipeline::State::do_share() noexcept {
  // What is left is spread over the calls before the one that closes the next keyframe.
  const std::uint32_t scans = std::min(config.keyframe.scans, builder.expected_scans());
  const std::uint32_t taken = builder.is_open() ? builder.scans().scans() : 1;
  if (taken + 1 >= scans) return finish();
  const std::uint32_t calls = scans - taken;
  const std::uint32_t slices = (finisher.steps_left() + calls - 1) / calls;
  for (std::uint32_t i = 0; i < slices; ++i) do_slice();
}

void Pipeline::State::finish_late() noexcept {
  if (!finisher.is_busy()) return;
  constexpr auto kTotal = static_cast<std::size_t>(Stage::kTotal);
  const float before_us = closed->statistics.stage_us[kTotal];
  for (; finisher.is_busy(); ++closed->statistics.late_slices) do_slice();
  // This call took that time, but not for the keyframe that it closes.
  current->statistics.stage_us[kTotal] -= closed->statistics.stage_us[kTotal] - before_us;
}

void Pipeline::State::tell_finished() noexcept {
  finished = closed;
  finished_untold = true;
  events.finished(*finished);
}

WorkResult Pipeline::State::work(std::uint32_t budget_us) noexcept {
  const TimeLimit limit(config.clock_ns, budget_us);
  do {
    do_slice();
  } while (finisher.is_busy() && !limit.is_over());
  return {finisher.is_busy(), take_finished()};
}

// ---------------------------------------------------------------------------------------------
// Bookkeeping

void Pipeline::State::write_view() noexcept {
  KeyframeView& view = current->view;
  removal.tell(*current);
  view.static_cells = output.static_cells();
  view.dynamic_cells = output.dynamic_cells();
  current->statistics.dynamic_cells = static_cast<std::uint32_t>(view.dynamic_cells.size());
  const KeyframeEvidence& recorded = window.earlier(1);
  const std::span<const RangeImage> painted = recorded.painted();
  for (std::size_t i = 0; i < painted.size(); ++i) {
    current->images[i] = {painted[i].scan, {painted[i].pixels, recorded.projection.pixels()}};
  }
  view.image_shape = recorded.shape;
  view.image_full_weight_range_m = recorded.full_weight_range_m;
  view.images = {current->images, painted.size()};
  view.statistics = &current->statistics;
  current->use(Capacity::kBlocks, window.blocks().size(), window.blocks().capacity());
}

void Pipeline::State::count_points() noexcept {
  KeyframeStatistics& statistics = current->statistics;
  const std::uint64_t invalid =
      statistics.dropped_by(DropCause::kNotFinite) + statistics.dropped_by(DropCause::kOutOfRange);
  statistics.points_dynamic = output.count_dynamic(builder.scans());
  statistics.points_static = statistics.points_in - invalid - statistics.points_dynamic;
  current->view.points_dynamic = statistics.points_dynamic;
}

// ---------------------------------------------------------------------------------------------
// What the caller sees

std::size_t Pipeline::required_bytes(const PipelineConfig& config) noexcept {
  if (config.validate().code != ErrorCode::kOk) return 0;
  Arena arena = Arena::measuring();
  arena.allocate<std::byte>(sizeof(State));
  State state(config);
  state.allocate(arena);
  return arena.used();
}

Expected<Pipeline*> Pipeline::create(const PipelineConfig& config,
                                     std::span<std::byte> memory) noexcept {
  const Error invalid = config.validate();
  if (invalid.code != ErrorCode::kOk) return invalid;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % Arena::kAlignment != 0) {
    return Error{ErrorCode::kMemoryMisaligned, "the memory must start on a 64-byte boundary"};
  }
  if (memory.size() < required_bytes(config)) {
    return Error{ErrorCode::kMemoryTooSmall,
                 "the memory is smaller than Pipeline::required_bytes(config)"};
  }
  Arena arena(memory.data(), memory.size());
  State* state = new (arena.allocate<std::byte>(sizeof(State))) State(config);
  state->allocate(arena);
  state->pipeline.state_ = state;
  return &state->pipeline;
}

ScanResult Pipeline::add_scan(const PointView& points, const Pose& T_odometry_sensor,
                              std::int64_t stamp_ns) noexcept {
  return state_->add_scan(points, T_odometry_sensor, stamp_ns);
}

ScanResult Pipeline::flush() noexcept { return state_->flush(); }

WorkResult Pipeline::work(std::uint32_t budget_us) noexcept { return state_->work(budget_us); }

const KeyframeView& Pipeline::keyframe() const noexcept { return state_->closed->view; }

const KeyframeView& Pipeline::finished_keyframe() const noexcept { return state_->finished->view; }

std::size_t Pipeline::labels(std::size_t scan_in_keyframe,
                             std::span<PointLabel> out) const noexcept {
  const ScanAccumulator& scans = state_->builder.scans();
  if (scan_in_keyframe >= scans.scans()) return 0;
  const auto scan = static_cast<std::uint32_t>(scan_in_keyframe);
  const std::span<const PointCode> codes = scans.codes(scan);
  const std::size_t count = std::min(out.size(), scans.points_of(scan));
  const std::size_t coded = std::min(count, codes.size());
  for (std::size_t i = 0; i < coded; ++i) out[i] = state_->output.label(codes[i]);
  // What did not fit the scan's capacity was never looked at.
  std::fill(out.begin() + static_cast<std::ptrdiff_t>(coded),
            out.begin() + static_cast<std::ptrdiff_t>(count), PointLabel::kStatic);
  return count;
}

std::size_t Pipeline::relabel(const PointView& points, const Pose& T_odometry_sensor,
                              std::span<PointLabel> labels) const noexcept {
  return state_->finisher.labels().relabel(points, state_->builder.used_pose(T_odometry_sensor),
                                           labels);
}

bool Pipeline::relabel_next() noexcept {
  state_->finish();
  FinalLabels& final_labels = state_->finisher.labels();
  const bool relabelled = !state_->builder.is_open() && final_labels.begin_oldest(state_->window);
  final_labels.finish(state_->window);
  state_->finished->view.relabelled = final_labels.result();
  return relabelled;
}

PlaceDatabase& Pipeline::places() noexcept {
  state_->finish();
  return state_->finisher.places();
}

const PipelineConfig& Pipeline::config() const noexcept { return state_->config; }

}  // namespace unimapper
