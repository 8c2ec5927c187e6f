// Answers of the receiver to the robots' probes.
#include <algorithm>

#include "unimapper/wire/receiver.hpp"

namespace unimapper::wire {

namespace {

/// Probes of a session that are answered; a robot sends five a second.
constexpr std::size_t kMostProbes = 8;
/// A robot that has been heard more recently shares the window with the others.
constexpr std::int64_t kActiveNs = 3000000000;

}  // namespace

void Receiver::receive(const ProbeMessage& message, const std::optional<ProbeArrival>& arrival) {
  ++counters_.messages;
  Session* state = session(message.session);
  if (state == nullptr) return;
  state->clock = message.clock;
  state->bytes_per_second = message.bytes_per_second;
  if (!arrival) return;
  state->last_probe_ns = arrival->steady_ns;
  if (state->probes.size() >= kMostProbes) state->probes.erase(state->probes.begin());
  state->probes.push_back({message.number, *arrival, state->pieces});
}

std::vector<ReceiptMessage> Receiver::take_receipts(std::uint64_t base, std::uint64_t window_bytes,
                                                    std::int64_t now_ns) {
  const auto active = static_cast<std::uint64_t>(
      std::count_if(sessions_.begin(), sessions_.end(), [now_ns](const auto& entry) {
        const auto& last = entry.second.last_probe_ns;
        return last && now_ns - *last < kActiveNs;
      }));
  const std::uint64_t share =
      std::max(kSmallestWindow, window_bytes / std::max<std::uint64_t>(1, active));
  std::vector<ReceiptMessage> receipts;
  for (auto& [id, state] : sessions_) {
    for (const Session::Probe& probe : state.probes) {
      const std::int64_t held_ns = std::max<std::int64_t>(0, now_ns - probe.arrival.steady_ns);
      receipts.push_back(
          {id, base, probe.number, probe.arrival.unix_ns, held_ns, probe.pieces, share});
    }
    state.probes.clear();
  }
  return receipts;
}

}  // namespace unimapper::wire
