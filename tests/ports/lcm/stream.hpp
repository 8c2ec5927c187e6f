// Sessions as LCM messages.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/lcm/sending.hpp"
#include "tests/wire/stream.hpp"

namespace unimapper::lcm_port::lcm_test {

using wire::wire_test::keyframe_of;

struct Message {
  std::string channel;
  std::vector<std::uint8_t> data;
};

/// A whole session, start to end.
inline std::vector<Message> session_stream(const SessionInfo& info, std::uint32_t keyframes) {
  const auto session = [&](SessionState state, std::uint64_t made) {
    return Message{std::string(kSessionChannel), encode(SessionMessage{info, state, made, 0})};
  };
  std::vector<Message> stream{session(SessionState::kStarted, 0)};
  for (std::uint32_t sequence = 0; sequence < keyframes; ++sequence) {
    const EncodedKeyframe keyframe =
        wire::wire_test::encode_for_sending(keyframe_of(info.id, sequence));
    for (auto& data : cut_into_messages(keyframe, 512)) {
      stream.push_back({std::string(kKeyframeChannel), std::move(data)});
    }
  }
  stream.push_back(session(SessionState::kEnded, keyframes));
  return stream;
}

inline void feed(Receiver& receiver, const std::vector<Message>& stream) {
  for (const Message& message : stream) receive(receiver, message.channel, message.data);
}

}  // namespace unimapper::lcm_port::lcm_test
