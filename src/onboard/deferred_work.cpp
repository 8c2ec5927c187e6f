// Schedule of deferred work: which slice comes next, and how many a call does
#include <algorithm>
#include <cstdint>

#include "pipeline_state.hpp"
#include "slice_cost.hpp"
#include "stage_clock.hpp"

namespace unimapper {

using namespace onboard;

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
    case Closing::kComponents:
      return removal.classify_cost();
    case Closing::kDecision:
      return slice_cost::decision(blocks);
    case Closing::kOutput:
      return slice_cost::kOutput;
    case Closing::kRecord:
      return slice_cost::record(blocks);
    case Closing::kCalibration:
      return calibration.is_busy() ? slice_cost::kCalibration : slice_cost::kBookkeeping;
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

}  // namespace unimapper
