#include "unimapper/onboard/pipeline.hpp"

#include <algorithm>
#include <cstdint>
#include <new>
#include <utility>

#include "pipeline_state.hpp"
#include "slice_cost.hpp"
#include "stage_clock.hpp"

namespace unimapper {

using namespace onboard;

void Pipeline::State::allocate(Arena& arena) noexcept {
  if (config.deferred) {
    waiting.allocate(arena, config.waiting_scans, config.keyframe.max_points_per_scan,
                     config.intensity);
  }
  builder.allocate(arena, config);
  removal.allocate(arena);
  finisher.allocate(arena);
  // Nothing reads the sums of the cells once they lie in the table, and nothing the table once
  // the rest of a keyframe is begun, which is finished before the next table is built. Labels, and
  // unless `deferred` the cells of a keyframe, are valid until the next scan comes; they are
  // written once components are classified.
  const auto allocate_cells = [&] { output.allocate_cells(arena, config); };
  arena.share([&] { builder.allocate_cells(arena, config); },
              [&] {
                removal.allocate_scratch(arena);
                output.allocate_labels(arena, config);
                arena.share([&] { removal.allocate_components(arena); },
                            [&] {
                              if (!config.deferred) allocate_cells();
                            });
              });
  arena.share([&] { removal.allocate_table(arena); }, [&] { finisher.allocate_scratch(arena); });
  if (config.deferred) allocate_cells();
  window.allocate(arena, config);
  gravity_planes.allocate(arena);
  calibration.allocate(arena, config);
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
  const ScanOrigin origin{index, stamp_ns, pose, std::exchange(slip, SlipCovariance::Zero())};
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
  if (!builder.is_adding()) {
    if (restarted) forget();
    calibration.add_scan(points, origin.T_odometry_sensor, origin.stamp_ns);
  }
  if (builder.add_step(points, origin, window, *current)) return true;
  if (builder.is_complete(*current)) close();
  return false;
}

void Pipeline::State::forget() noexcept {
  window.forget();
  finisher.forget();
  gravity.forget();
  odometry.forget();
  calibration.forget();
  standing.forget();
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

bool Pipeline::add_slip(const Eigen::Matrix3d& covariance_m2) noexcept {
  // What is symmetric but for rounding of the caller's sums is a covariance.
  const SlipCovariance slip = (0.5 * (covariance_m2 + covariance_m2.transpose())).cast<float>();
  if (slip.isZero(0.0F)) return true;
  if (!is_slip(slip)) return false;
  state_->slip += slip;
  return true;
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
