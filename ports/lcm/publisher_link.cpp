// Rate of a publisher and its knowledge of the base's clock.
#include <algorithm>
#include <utility>

#include "ports/lcm/publisher.hpp"

namespace unimapper::lcm_port {

namespace {

/// While pieces are on the way or due; otherwise as often as the session's message.
constexpr std::chrono::milliseconds kProbeInterval{200};

std::int64_t steady_ns(std::chrono::steady_clock::time_point time) {
  return std::chrono::nanoseconds(time.time_since_epoch()).count();
}

ClockOffsetFilter::RobotTime robot_time() {
  const std::int64_t steady = steady_ns(std::chrono::steady_clock::now());
  return {steady,
          std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count()};
}

}  // namespace

void Publisher::take_receipts() {
  if (!link_.receipts) return;
  for (const ReceivedReceipt& receipt : link_.receipts()) {
    if (receipt.message.session != session_.info.id) continue;
    const std::int64_t arrival_ns = steady_ns(receipt.arrival);
    if (!pacing_.take(receipt.message, arrival_ns)) continue;
    const std::int64_t round_trip_ns = pacing_.round_trip_ns();
    clock_.add(arrival_ns - receipt.message.held_ns - round_trip_ns, receipt.message.base_time_ns,
               round_trip_ns);
  }
  pacing_.advance(steady_ns(Clock::now()));
}

/// Bucket, outbox and counters follow the pacing.
void Publisher::apply_rate() {
  const Clock::time_point now = Clock::now();
  const auto clock = clock_.offset(robot_time());
  const std::lock_guard lock(mutex_);
  if (new_rate_) pacing_.set_maximum(*std::exchange(new_rate_, std::nullopt));
  if (pacing_.rate() != counters_.bytes_per_second) bucket_.set_rate(pacing_.rate(), now);
  if (pacing_.adapts()) {
    bucket_.set_burst(std::min<double>(options_.burst_bytes, pacing_.burst_bytes()));
    outbox_.set_resend_after(pacing_.resend_after_ns());
  }
  counters_.bytes_per_second = pacing_.rate();
  counters_.rate_adapts = pacing_.adapts();
  counters_.loss = pacing_.loss();
  counters_.window_bytes = pacing_.window_bytes().value_or(0);
  counters_.round_trip_ns = pacing_.round_trip_ns();
  counters_.clock = clock;
}

/// Where the rate follows the link the summaries of all keyframes go first, and what would be
/// dropped from a full queue waits in the memory of unacknowledged keyframes instead. `mutex_` is
/// held.
bool Publisher::may_hold_early() const {
  return pacing_.adapts() && options_.drop_when_full &&
         held_bytes_ + queue_.front().bytes <= options_.unacknowledged_bytes;
}

void Publisher::send_probe_if_due() {
  if (!link_.receipts) return;
  const Clock::time_point now = Clock::now();
  const bool is_busy = pacing_.bytes_on_the_way() > 0.0 || outbox_.next().has_value();
  const Clock::duration interval =
      is_busy ? std::min<Clock::duration>(kProbeInterval, options_.session_period)
              : Clock::duration(options_.session_period);
  if (now - last_probe_ < interval) return;
  last_probe_ = now;
  ProbeMessage probe;
  probe.session = session_.info.id;
  probe.bytes_per_second = static_cast<std::uint64_t>(pacing_.rate());
  const ClockOffsetFilter::RobotTime time = robot_time();
  probe.clock = clock_.offset(time);
  probe.robot_time_ns = time.unix_ns;
  probe.number = pacing_.probe(time.steady_ns);
  send_message(kProbeChannel, encode(probe));
}

}  // namespace unimapper::lcm_port
