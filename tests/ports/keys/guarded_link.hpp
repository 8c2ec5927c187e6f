// Robot and base with keys, and a network between them that an attacker reads and writes.
#pragma once

#include "ports/keys/guards.hpp"
#include "ports/keys/signature.hpp"
#include "ports/lcm/latest_map_pose.hpp"
#include "ports/lcm/messages.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/lcm/sending.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::keys::keys_test {

using Data = std::vector<std::uint8_t>;

/// One datagram on the network.
struct Datagram {
  std::string channel;
  Data bytes;
};

/// What the attacker puts on the network before a datagram, which it has read, arrives.
using Attack = std::function<std::vector<Datagram>(const Datagram& overheard)>;

inline std::vector<Datagram> no_attack(const Datagram& /*overheard*/) { return {}; }

/// A base that listens with keys.
struct Base {
  explicit Base(const std::vector<BaseKey>& keys, const BootId& boot = {9, 9}) : guard(keys, boot) {
    receiver.set_check([this](const SessionId& session, wire::Bytes keyframe) {
      return guard.accepts(session, keyframe);
    });
  }
  void hear(const Datagram& datagram) {
    if (const auto message = guard.open(datagram.channel, datagram.bytes)) {
      lcm_port::receive(receiver, datagram.channel, *message);
    }
  }
  std::vector<Datagram> answers() {
    std::vector<Datagram> sealed;
    const std::string channel(lcm_port::kStoredChannel);
    for (const wire::StoredMessage& message : receiver.take_stored()) {
      if (auto bytes = guard.seal(channel, lcm_port::encode(message))) {
        sealed.push_back({channel, std::move(*bytes)});
      }
    }
    return sealed;
  }

  BaseGuard guard;
  wire::Receiver receiver;
  std::uint64_t sent = 0;  ///< answers
};

/// A robot that sends keyframes until it hears that they are stored.
struct Robot {
  static constexpr std::uint32_t kDatagramBytes = 1300;
  static constexpr std::uint32_t kCells = 400;

  Robot(const RobotKey& robot_key, const BootId& boot)
      : info{{robot_key.robot, boot}, robot_key.name, "os1-64"},
        guard(robot_key, boot),
        signer(robot_key),
        map_pose(info.id) {}

  /// A keyframe as it is on this robot, without its signature.
  [[nodiscard]] Data plain(std::uint32_t sequence) const {
    return wire::encode_keyframe(wire::wire_test::keyframe_of(info.id, sequence, kCells));
  }
  void make(std::uint32_t count) {
    for (std::uint32_t sequence = 0; sequence < count; ++sequence) {
      wire::EncodedKeyframe keyframe{info.id, sequence, 0, plain(sequence)};
      signer.sign(keyframe.bytes);
      messages.push_back(lcm_port::cut_into_messages(keyframe, kDatagramBytes));
      outbox.add(sequence, static_cast<std::uint32_t>(messages.back().size()));
    }
  }
  Datagram say(std::string_view channel, const Data& message) {
    return {std::string(channel), guard.seal(channel, message).value()};
  }
  Datagram session(wire::SessionState state) {
    return say(lcm_port::kSessionChannel,
               lcm_port::encode(wire::SessionMessage{info, state, messages.size(), 0}));
  }
  void hear(const Datagram& datagram) {
    const auto bytes = guard.open(datagram.channel, datagram.bytes);
    if (!bytes) return;
    if (datagram.channel == lcm_port::kMapPoseChannel) {
      return map_pose.take(lcm_port::decode_map_pose(*bytes), {});
    }
    const auto message = lcm_port::decode_stored(*bytes);
    if (!message || message->session != info.id) return;
    for (const std::uint32_t sequence : outbox.take(*message, clock)) {
      acknowledged.push_back(sequence);
    }
  }

  SessionInfo info;
  RobotGuard guard;
  KeyframeSigner signer;
  std::vector<std::vector<Data>> messages;
  lcm_port::LatestMapPose map_pose;
  wire::Outbox outbox{0};
  std::int64_t clock = 0;
  std::vector<std::uint32_t> acknowledged;
  std::uint64_t sent = 0;  ///< datagrams
};

/// A robot's whole session over the attacked network, until the base has acknowledged everything or
/// `rounds` are over.
inline void drive(Robot& robot, Base& base, const Attack& attack = no_attack, int rounds = 20) {
  const auto to_base = [&](const Datagram& datagram) {
    for (const Datagram& forged : attack(datagram)) base.hear(forged), robot.hear(forged);
    base.hear(datagram);
    ++robot.sent;
  };
  to_base(robot.session(wire::SessionState::kStarted));
  for (int round = 0; round < rounds && robot.outbox.size() > 0; ++round) {
    while (const auto piece = robot.outbox.next()) {
      to_base(robot.say(lcm_port::kKeyframeChannel, robot.messages[piece->sequence][piece->index]));
      robot.outbox.sent(*piece, ++robot.clock);
    }
    to_base(robot.session(wire::SessionState::kRunning));
    for (const Datagram& answer : base.answers()) {
      for (const Datagram& forged : attack(answer)) base.hear(forged), robot.hear(forged);
      robot.hear(answer);
      ++base.sent;
    }
  }
}

/// Everything that the robot made is at the base as it was made, and nothing else; of the
/// datagrams, each end has taken those of the other, all and only.
inline void check_whole(const Robot& robot, Base& base) {
  CHECK(base.guard.counters().accepted == robot.sent);
  CHECK(robot.guard.counters().accepted == base.sent);
  CHECK(base.receiver.counters().malformed == 0);
  CHECK(robot.outbox.size() == 0);
  CHECK(robot.acknowledged.size() == robot.messages.size());
  const std::vector<SessionData> sessions = base.receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].info.id == robot.info.id);
  CHECK(sessions[0].info.name == robot.info.name);
  CHECK_FALSE(sessions[0].complete);
  CHECK(sessions[0].keyframes_damaged == 0);
  REQUIRE(sessions[0].keyframes.size() == robot.messages.size());
  for (std::uint32_t i = 0; i < sessions[0].keyframes.size(); ++i) {
    CHECK(wire::encode_keyframe(sessions[0].keyframes[i]) == robot.plain(i));
  }
}

}  // namespace unimapper::keys::keys_test
