#include "ports/lcm/received_log.hpp"

#include <optional>
#include <utility>

#include "ports/lcm/envelope.hpp"
#include "ports/lcm/event_log.hpp"
#include "ports/lcm/messages.hpp"

namespace unimapper::lcm_port {

namespace {

template <typename Message>
void take(Receiver& receiver, std::optional<Message>&& message) {
  if (message) {
    receiver.receive(std::move(*message));
  } else {
    receiver.count_malformed();
  }
}

}  // namespace

void receive(Receiver& receiver, std::string_view channel, wire::Bytes data) {
  if (is_envelope(data)) {
    const auto envelope = read_envelope(data);
    data = envelope ? envelope->message : wire::Bytes();
  }
  if (channel == kSessionChannel) {
    take(receiver, decode_session(data));
  } else if (channel == kKeyframeChannel) {
    take(receiver, decode_chunk(data));
  } else if (channel == kHealthChannel) {
    take(receiver, decode_health(data));
  } else if (channel == kProbeChannel) {
    take(receiver, decode_probe(data));
  } else {
    receiver.count_foreign();
  }
}

std::vector<std::string> feed_event_log(Receiver& receiver, const std::filesystem::path& path) {
  EventLogReader reader(path);
  LogEvent event;
  while (reader.next(event)) receive(receiver, event.channel, event.data);
  return reader.fault_sentences();
}

ReceivedLog read_event_log(const std::filesystem::path& path, const ReceiverLimits& limits) {
  Receiver receiver(limits);
  ReceivedLog log;
  log.faults = feed_event_log(receiver, path);
  log.counters = receiver.counters();
  log.sessions = receiver.take_sessions();
  return log;
}

}  // namespace unimapper::lcm_port
