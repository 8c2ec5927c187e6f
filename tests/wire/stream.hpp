// Sessions as messages.
#pragma once

#include <utility>
#include <variant>
#include <vector>

#include "tests/wire/records.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/pieces.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::wire::wire_test {

using Message = std::variant<SessionMessage, ChunkMessage, HealthMessage>;

inline KeyframeRecord keyframe_of(const SessionId& id, std::uint32_t sequence,
                                  std::uint32_t cells = 300) {
  KeyframeRecord record = random_record(id.boot.low * 1000 + sequence, cells);
  record.session = id;
  record.sequence = sequence;
  return record;
}

/// A record as the robot that made it sends it.
inline EncodedKeyframe encode_for_sending(const KeyframeRecord& record) {
  EncodedKeyframe keyframe;
  keyframe.bytes = encode_keyframe(record);
  keyframe.session = record.session;
  keyframe.sequence = record.sequence;
  keyframe.stamp_ns = record.scans.back().stamp_ns;
  return keyframe;
}

inline Message session_message(const SessionInfo& info, SessionState state, std::uint64_t keyframes,
                               std::uint64_t dropped = 0) {
  return SessionMessage{info, state, keyframes, dropped};
}

inline std::vector<Message> pieces_of(const EncodedKeyframe& keyframe) {
  std::vector<Message> messages;
  for (ChunkMessage& piece : cut_into_pieces(keyframe, 433)) messages.push_back(std::move(piece));
  return messages;
}

inline std::vector<Message> pieces(const KeyframeRecord& record) {
  return pieces_of(encode_for_sending(record));
}

inline std::vector<Message> pieces(const SessionId& id, std::uint32_t sequence) {
  return pieces(keyframe_of(id, sequence));
}

/// A whole session, start to end.
inline std::vector<Message> session_stream(const SessionInfo& info, std::uint32_t keyframes) {
  std::vector<Message> stream{session_message(info, SessionState::kStarted, 0)};
  for (std::uint32_t sequence = 0; sequence < keyframes; ++sequence) {
    for (Message& piece : pieces(info.id, sequence)) stream.push_back(piece);
  }
  stream.push_back(session_message(info, SessionState::kEnded, keyframes));
  return stream;
}

inline void feed(Receiver& receiver, Message message) {
  std::visit([&](auto&& one) { receiver.receive(std::move(one)); }, std::move(message));
}
inline void feed(Receiver& receiver, const std::vector<Message>& stream) {
  for (const Message& message : stream) feed(receiver, message);
}

/// The order of a bad day.
template <typename T>
void shuffle(std::vector<T>& items, Random& random) {
  for (std::size_t i = items.size(); i > 1; --i) {
    std::swap(items[i - 1], items[random.below(static_cast<std::uint32_t>(i))]);
  }
}

}  // namespace unimapper::wire::wire_test
