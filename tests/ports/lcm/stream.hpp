// Sessions as messages.
#pragma once

#include <string>
#include <vector>

#include "ports/lcm/sending.hpp"
#include "tests/ports/lcm/records.hpp"

namespace unimapper::wire::test {

struct Message {
  std::string channel;
  std::vector<std::uint8_t> data;
};

inline KeyframeRecord keyframe_of(const SessionId& id, std::uint32_t sequence,
                                  std::uint32_t cells = 300) {
  KeyframeRecord record = random_record(id.session * 1000 + sequence, cells);
  record.session = id;
  record.sequence = sequence;
  return record;
}

inline Message session_message(const SessionInfo& info, SessionState state, std::uint64_t keyframes,
                               std::uint64_t dropped = 0) {
  return {std::string(kSessionChannel), encode(SessionMessage{info, state, keyframes, dropped})};
}

inline std::vector<Message> pieces(const KeyframeRecord& record,
                                   std::uint32_t datagram_bytes = 512) {
  std::vector<Message> messages;
  for (auto& data : cut_into_messages(encode_for_sending(record), datagram_bytes)) {
    messages.push_back({std::string(kKeyframeChannel), std::move(data)});
  }
  return messages;
}

/// A whole session, start to end.
inline std::vector<Message> session_stream(const SessionInfo& info, std::uint32_t keyframes) {
  std::vector<Message> stream{session_message(info, SessionState::kStarted, 0)};
  for (std::uint32_t sequence = 0; sequence < keyframes; ++sequence) {
    for (Message& piece : pieces(keyframe_of(info.id, sequence))) stream.push_back(piece);
  }
  stream.push_back(session_message(info, SessionState::kEnded, keyframes));
  return stream;
}

/// The order of a bad day.
template <typename T>
void shuffle(std::vector<T>& items, Random& random) {
  for (std::size_t i = items.size(); i > 1; --i) {
    std::swap(items[i - 1], items[random.below(static_cast<std::uint32_t>(i))]);
  }
}

}  // namespace unimapper::wire::test
