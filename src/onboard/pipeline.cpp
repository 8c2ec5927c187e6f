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
#include "scan_queue.hpp"
#include "slice_cost.hpp"
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
  ScanResult flush() noexcept;
  WorkResult work(std::uint32_t budget_us) noexcept;

  /// Checks a scan and adds it, or lets it wait. Returns why it was refused, or `kOk`.
  Error take_scan(const PointView& points, const Pose& pose, std::int64_t stamp_ns) noexcept;
  void ingest(const PointView& points, const ScanOrigin& origin, bool restarted) noexcept;
  /// A slice of that; false once it was the last one.
  bool ingest_step(const PointView& points, const ScanOrigin& origin, bool restarted) noexcept;
  void forget() noexcept;

  // Closing a keyframe.
  void close() noexcept;
  void close_after_last_scan() noexcept;
  void close_now() noexcept;
  void remove_now() noexcept;
  void close_step() noexcept;
  void begin_closing() noexcept;
  void decide() noexcept;
  void record() noexcept;
  void announce() noexcept;
  /// Where the keyframe that is closing was seen from.
  [[nodiscard]] Viewpoint viewpoint() const noexcept;
  /// Looks for up among what is static, and levels the keyframe's frame by it.
  void find_up() noexcept;
  /// Writes down what is known of the keyframe but its place.
  void write_view() noexcept;
  void count_points() noexcept;

  // Deferred work.
  /// A slice of what comes first: the keyframe that closes, scans that wait, what is left to be
  /// done for the keyframe before.
  void do_slice() noexcept;
  void do_closing_slice() noexcept;
  void do_waiting_slice() noexcept;
  void do_finishing_slice() noexcept;
  /// What the next slice costs, about, and all that is left.
  [[nodiscard]] std::uint32_t next_cost() const noexcept;
  [[nodiscard]] std::uint32_t cost_left() const noexcept;
  [[nodiscard]] std::uint32_t closing_step_cost() const noexcept;
  [[nodiscard]] std::uint32_t closing_cost_left() const noexcept;
  /// What this call should cost, so that all calls until the next keyframe closes cost as much:
  /// what was done in it, what is left, and the scans to come, spread over them.
  [[nodiscard]] std::uint32_t share() const noexcept;
  void do_share() noexcept;
  /// Takes a scan out of a queue that is full.
  void make_room() noexcept;
  /// Finishes the last keyframe that is ready.
  void finish() noexcept;
  void tell_finished() noexcept;
  /// The keyframe, or another one after it, is not ready yet.
  [[nodiscard]] bool is_behind() const noexcept {
    return closing != Closing::kNone || !waiting.is_empty();
  }
  [[nodiscard]] bool is_busy() const noexcept { return is_behind() || finisher.is_busy(); }
  /// Whether a slice can be done before the caller has seen what is new: the labels of a keyframe
  /// that is ready hold as long as no scan is added, and what was told of one that is finished
  /// until another one is being finished.
  [[nodiscard]] bool may_continue() const noexcept {
    return ready_untold ? finisher.is_busy() && !finished_untold : is_busy();
  }
  /// What is relabelled in slices reads the window's occupancy before that is gone.
  static void finish_labels(void* state) noexcept {
    static_cast<State*>(state)->finisher.labels().finish(static_cast<State*>(state)->window);
  }
  /// What the caller has to be told since the last time this was asked.
  [[nodiscard]] ScanResult take_news(const Error& error) noexcept {
    return {error, std::exchange(ready_untold, false), std::exchange(finished_untold, false)};
  }

  PipelineConfig config;
  Pipeline pipeline;  ///< what the caller holds

  MotionGate gate;
  Budget budget;
  ScanQueue waiting;
  KeyframeBuilder builder;
  EvidenceWindow window;
  DynamicRemoval removal;
  GravityPlanes gravity_planes;
  GravityEstimator gravity;
  KeyframeOutput output;
  KeyframeFinisher finisher;
  EventReporter events;

  /// What closes a keyframe, in this order.
  enum class Closing : std::uint8_t {
    kBegin,
    kRemoval,       ///< which cells are dynamic
    kDecision,      ///< what follows from that at once: what final labels need, and up
    kOutput,        ///< labels and cells
    kRecord,        ///< in the window
    kCounting,      ///< points
    kAnnouncement,  ///< to the caller
    kNone           ///< no keyframe is being closed
  };
  Closing closing = Closing::kNone;
  std::uint32_t scan_index = 0;
  std::uint32_t sequence = 0;
  Keyframe keyframes[2];
  Keyframe* current = &keyframes[0];   ///< the open one, or the one that the next scan begins
  Keyframe* closed = &keyframes[1];    ///< the last one that was closed
  Keyframe* finished = &keyframes[1];  ///< the last one that was finished
  bool ready_untold = false;           ///< the caller does not know yet that `closed` is ready,
  bool finished_untold = false;        ///< or of `finished`

  // Costs are those of `slice_cost`.
  std::uint32_t closing_cost = 0;  ///< of slices done for the keyframe that closes, or the last one
  std::uint32_t cost_of_1024_blocks = 1024;  ///< of closing the keyframe before
  std::uint32_t late_slices = 0;             ///< of closing a keyframe, because the queue was full
  std::uint32_t call_cost = 0;               ///< of what was done in this call
  std::size_t scan_points = 0;               ///< of the last scan
  float longest_call_us = 0.0F;              ///< since the last keyframe was ready
};

void Pipeline::State::allocate(Arena& arena) noexcept {
  if (config.deferred) {
    waiting.allocate(arena, config.waiting_scans, config.keyframe.max_points_per_scan);
  }
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
  budget.start();
  if (!config.deferred) return take_news(take_scan(points, pose, stamp_ns));
  make_room();
  const Error error = take_scan(points, pose, stamp_ns);
  do_share();
  longest_call_us = std::max(longest_call_us, budget.spent_us());
  return take_news(error);
}

Error Pipeline::State::take_scan(const PointView& points, const Pose& pose,
                                 std::int64_t stamp_ns) noexcept {
  const StageTimer timer(config.clock_ns, current->statistics, Stage::kTotal);
  const std::uint32_t index = scan_index++;
  call_cost = 0;
  const auto refuse = [&](const Error& error) noexcept {
    events.refusal(error, stamp_ns, index);
    return error;
  };
  const Motion motion = gate.check(pose, stamp_ns);
  if (motion.error.code != ErrorCode::kOk) {
    const bool jumped =
        motion.error.code == ErrorCode::kPoseJump || motion.error.code == ErrorCode::kTimeJump;
    const Error refused = refuse(motion.error);
    if (jumped) close_after_last_scan();
    return refused;
  }
  if (!builder.is_usable(points)) {
    return refuse({ErrorCode::kEmptyScan,
                   "the scan has no point that is finite and within the sensor's range"});
  }
  gate.accept(pose, stamp_ns);
  const ScanOrigin origin{index, stamp_ns, pose};
  scan_points = points.count;
  if (config.deferred && (is_behind() || builder.must_measure())) {
    waiting.push(points, origin, motion.restarted);
    call_cost = slice_cost::copying(points.count);
  } else {
    call_cost = builder.cost_left(points.count);
    ingest(points, origin, motion.restarted);
  }
  return {};
}

void Pipeline::State::ingest(const PointView& points, const ScanOrigin& origin,
                             bool restarted) noexcept {
  while (ingest_step(points, origin, restarted)) {
  }
}

bool Pipeline::State::ingest_step(const PointView& points, const ScanOrigin& origin,
                                  bool restarted) noexcept {
  // Two poses in a row say that the robot is elsewhere: whatever was seen before is of no use.
  if (restarted && !builder.is_adding()) forget();
  if (builder.add_step(points, origin, window, *current)) return true;
  if (builder.is_complete(*current)) close();
  return false;
}

void Pipeline::State::forget() noexcept {
  window.forget();
  finisher.forget();
  gravity.forget();
  builder.forget();
}

ScanResult Pipeline::State::flush() noexcept {
  budget.start();
  {
    const StageTimer timer(config.deferred ? nullptr : config.clock_ns, current->statistics,
                           Stage::kTotal);
    close_after_last_scan();
  }
  while (is_behind() && !ready_untold) do_slice();
  finish();
  return take_news({});
}

// ---------------------------------------------------------------------------------------------
// Closing a keyframe

void Pipeline::State::close() noexcept {
  if (!builder.is_open() || closing != Closing::kNone) return;
  closing = Closing::kBegin;
  closing_cost = 0;
  if (!config.deferred) close_now();
}

void Pipeline::State::close_after_last_scan() noexcept {
  if (waiting.is_empty()) return close();
  waiting.back().closes = true;
}

/// The order of everything, from the last scan of a keyframe to its labels.
void Pipeline::State::close_step() noexcept {
  switch (closing) {
    case Closing::kBegin:
      begin_closing();
      break;
    case Closing::kRemoval:
      if (removal.step(builder.scans().cells(), window)) return;
      break;
    case Closing::kDecision:
      decide();
      break;
    case Closing::kOutput:
      if (output.step(window.blocks(), removal.cells(), removal.voxels())) return;
      break;
    case Closing::kRecord:
      record();
      break;
    case Closing::kCounting:
      count_points();
      break;
    case Closing::kAnnouncement:
      announce();
      break;
    case Closing::kNone:
      return;
  }
  closing = static_cast<Closing>(static_cast<std::uint8_t>(closing) + 1U);
}

/// All of it at once, and what would be deferred.
void Pipeline::State::close_now() noexcept {
  close_step();
  remove_now();
  finisher.begin(*current);
  finisher.finish_now(budget);
  budget.measure(Budget::Part::kCounting, 1, [this] { close_step(); });
  close_step();
  tell_finished();
}

void Pipeline::State::remove_now() noexcept {
  const StageTimer timer(config.clock_ns, current->statistics, Stage::kRemoval);
  removal.weigh_now(builder.scans().cells(), window, budget);
  budget.measure(Budget::Part::kClassifying, 1, [&] {
    while (closing < Closing::kCounting) close_step();
  });
}

void Pipeline::State::begin_closing() noexcept {
  current->view = {};
  current->view.sequence = sequence++;
  builder.close(*current);
  removal.begin(builder.scans().grid(), viewpoint());
}

void Pipeline::State::decide() noexcept {
  finisher.begin_labels(window, removal.cells(), finished_untold, *current);
  find_up();
  output.begin(window.blocks(), removal.cells(), current->view.T_odometry_keyframe);
}

void Pipeline::State::record() noexcept {
  window.record(removal.cells());
  write_view();
}

void Pipeline::State::announce() noexcept {
  current->spent_us = config.deferred ? longest_call_us : budget.spent_us();
  current->statistics.deadline_missed = budget.is_missed_by(current->spent_us);
  current->statistics.late_slices = std::exchange(late_slices, 0);
  longest_call_us = 0.0F;
  const std::uint64_t blocks = std::max(builder.scans().cells().block_count(), 1U);
  cost_of_1024_blocks = static_cast<std::uint32_t>(closing_cost * std::uint64_t{1024} / blocks);
  events.closed(*current);
  closed = std::exchange(current, closed);
  ready_untold = true;
  if (config.deferred) finisher.begin(*closed);
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
// Deferred work

void Pipeline::State::do_slice() noexcept {
  if (ready_untold) return do_finishing_slice();
  if (closing != Closing::kNone) return do_closing_slice();
  if (!waiting.is_empty()) return do_waiting_slice();
  do_finishing_slice();
}

std::uint32_t Pipeline::State::next_cost() const noexcept {
  if (!ready_untold) {
    if (closing > Closing::kBegin && closing != Closing::kNone) return closing_step_cost();
    if (closing == Closing::kNone && !waiting.is_empty()) {
      return builder.must_measure() ? slice_cost::kMeasuring
                                    : builder.step_cost(waiting.front().points.count);
    }
  }
  return finisher.is_busy() ? finisher.step_cost() : slice_cost::kBookkeeping;
}

std::uint32_t Pipeline::State::closing_step_cost() const noexcept {
  const std::uint32_t blocks = builder.scans().cells().block_count();
  switch (closing) {
    case Closing::kRemoval:
      return removal.step_cost(blocks);
    case Closing::kDecision:
      return slice_cost::kDecision;
    case Closing::kOutput:
      return slice_cost::kOutput;
    case Closing::kRecord:
      return slice_cost::record(blocks);
    case Closing::kCounting:
      return slice_cost::counting(current->statistics.points_in);
    default:
      return slice_cost::kBookkeeping;
  }
}

void Pipeline::State::do_closing_slice() noexcept {
  // The keyframe before comes first: it is described where the next one's cells will lie.
  if (closing == Closing::kBegin && finisher.is_busy()) return do_finishing_slice();
  const StageTimer total(config.clock_ns, current->statistics, Stage::kTotal);
  const StageTimer timer(config.clock_ns, current->statistics, Stage::kRemoval);
  closing_cost += closing_step_cost();
  close_step();
}

void Pipeline::State::do_waiting_slice() noexcept {
  const StageTimer total(config.clock_ns, current->statistics, Stage::kTotal);
  const ScanQueue::Scan& scan = waiting.front();
  if (builder.must_measure() && builder.measure(scan.points)) return;
  if (ingest_step(scan.points, scan.origin, scan.restarted)) return;
  if (scan.closes) close();
  waiting.pop();
}

void Pipeline::State::do_finishing_slice() noexcept {
  if (finisher.is_busy() && !finisher.step(window)) tell_finished();
}

std::uint32_t Pipeline::State::closing_cost_left() const noexcept {
  if (closing == Closing::kNone) return 0;
  const std::uint64_t blocks = builder.scans().cells().block_count();
  const auto expected = static_cast<std::uint32_t>(blocks * cost_of_1024_blocks / 1024);
  const std::uint32_t next = closing_step_cost();
  return expected > closing_cost + next ? expected - closing_cost : next;
}

std::uint32_t Pipeline::State::cost_left() const noexcept {
  std::uint32_t cost = closing_cost_left() + finisher.cost_left();
  // The keyframe that closes will have to be finished, too.
  if (closing != Closing::kNone) cost += finisher.whole_cost();
  if (!waiting.is_empty()) cost += builder.cost_left(waiting.front().points.count);
  for (std::uint32_t i = 1; i < waiting.size(); ++i) {
    cost += builder.cost_later(waiting[i].points.count);
  }
  return cost;
}

std::uint32_t Pipeline::State::share() const noexcept {
  // The scans of the next keyframe that are here, and the calls before the one that completes it.
  const std::uint32_t open =
      closing == Closing::kNone && builder.is_open() ? builder.scans().scans() : 0;
  const std::uint32_t arrived = waiting.size() + open;
  const std::uint32_t expected = std::min(config.keyframe.scans, builder.expected_scans());
  const std::uint32_t calls = expected > arrived ? expected - arrived : 1;
  const std::uint32_t all = call_cost + cost_left() + (calls - 1) * builder.cost_later(scan_points);
  return (all + calls - 1) / calls;
}

void Pipeline::State::do_share() noexcept {
  while (may_continue()) {
    const std::uint32_t cost = next_cost();
    const std::uint32_t timed = std::max(cost, slice_cost::kLeastTimed);
    if (call_cost + cost / 2 > share() || !budget.affords(timed)) break;
    budget.measure_slice(timed, [this] { do_slice(); });
    call_cost += cost;
  }
  // No scan may find the queue full, and the labels of a keyframe last until the next call.
  for (; waiting.is_full() && closing != Closing::kNone; ++late_slices) do_slice();
}

void Pipeline::State::make_room() noexcept {
  while (waiting.is_full()) do_slice();
}

void Pipeline::State::finish() noexcept {
  while (finisher.is_busy() && !finished_untold) do_finishing_slice();
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
  } while (may_continue() && !limit.is_over());
  const ScanResult news = take_news({});
  return {is_busy(), news.keyframe_ready, news.keyframe_finished};
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
  view.cell_size_m = config.voxel.fine_size_m;
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
  const bool is_next = state_->builder.is_open() || state_->closing != State::Closing::kNone;
  if (is_next || scan_in_keyframe >= scans.scans()) return 0;
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
  if (state_->is_busy()) return false;
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
