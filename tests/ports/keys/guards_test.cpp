// Tests of authenticated datagrams: with keys on, no forgery costs a keyframe or adds one.
#include "ports/keys/guards.hpp"

#include "ports/keys/key_files.hpp"
#include "tests/ports/keys/guarded_link.hpp"
#include "tests/ports/lcm/damage.hpp"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::keys;
using namespace unimapper::keys::keys_test;
using lcm_port::kKeyframeChannel;
using lcm_port::kMapPoseChannel;
using lcm_port::kSessionChannel;
using lcm_port::kStoredChannel;
using lcm_port::lcm_test::map_pose_of;

namespace {

constexpr std::uint32_t kKeyframes = 4;
constexpr BootId kBoot{0x1122334455667788ULL, 0x99AABBCCDDEEFF00ULL};

/// A robot, a base that has its key, and an attacker who has the key of another robot.
struct Scene {
  RobotKey key = new_robot_key("robot");
  RobotKey other = new_robot_key("other");
  Base base{{base_key_of(key), base_key_of(other)}};
  Robot robot{key, kBoot};

  Scene() { robot.make(kKeyframes); }
};

/// A datagram with the code of whoever has this key, whatever robot the message is of: a program of
/// the forger's own.
Data coded(const RobotKey& key, const BootId& boot, std::string_view channel, const Data& message) {
  static std::uint64_t number = 0;
  Data bytes = lcm_port::write_envelope({key.robot, boot, number++, message, {}, {}});
  const Code code = DatagramCoder(key.link, End::kRobot, boot).code(channel, bytes);
  bytes.insert(bytes.end(), code.begin(), code.end());
  return bytes;
}

Data message_in(const Datagram& datagram) {
  const auto envelope = lcm_port::read_envelope(datagram.bytes);
  REQUIRE(envelope.has_value());
  return {envelope->message.begin(), envelope->message.end()};
}

/// A keyframe of the victim's number, made up.
std::vector<Data> forged_keyframe(const SessionId& victim, std::uint32_t sequence,
                                  std::size_t images = 0) {
  KeyframeRecord record = wire::wire_test::keyframe_of(victim, sequence, 30);
  record.T_odometry_keyframe.translation.x() += 500.0;
  if (images > 0) {
    record.image_shape = {90.0F, 30.0F, 0.0F, 30.0F, 30.0F};
    record.image_full_weight_range_m = 64.0F;
    record.images.assign(images, {0, {0x00, 0xE0, 0x5D, 0x00}});
  }
  return lcm_port::cut_into_messages(wire::wire_test::encode_for_sending(record), 60000);
}

/// Ways of a forger to send messages on the victim's behalf.
std::vector<Datagram> every_way(Scene& scene, const Datagram& overheard, std::string_view channel,
                                const std::vector<Data>& messages) {
  const std::string name(channel);
  std::vector<Datagram> forged;
  for (const Data& message : messages) {
    forged.push_back({name, message});  // without an envelope
    // In the victim's envelope, with the code that was overheard.
    lcm_port::Envelope envelope = lcm_port::read_envelope(overheard.bytes).value();
    const Data code(envelope.code.begin(), envelope.code.end());
    envelope.message = message;
    ++envelope.number;
    Data bytes = lcm_port::write_envelope(envelope);
    bytes.insert(bytes.end(), code.begin(), code.end());
    forged.push_back({name, bytes});
    // With a key of its own, as itself and as the victim.
    forged.push_back({name, coded(scene.other, {5, 5}, channel, message)});
    RobotKey disguised = scene.other;
    disguised.robot = scene.key.robot;
    forged.push_back({name, coded(disguised, {5, 6}, channel, message)});
  }
  return forged;
}

}  // namespace

TEST_CASE("with keys, a session arrives whole and is acknowledged") {
  Scene scene;
  drive(scene.robot, scene.base);
  CHECK(scene.base.guard.counters().refused() == 0);
  CHECK(describe(scene.base.guard.counters()).empty());
  CHECK(scene.robot.guard.counters().refused() == 0);
  CHECK(scene.base.guard.counters().accepted > kKeyframes);
  check_whole(scene.robot, scene.base);
}

TEST_CASE("no forgery costs a keyframe or adds one") {
  Scene scene;
  const SessionId victim = scene.robot.info.id;
  Attack attack;
  SECTION("overheard heads with other data") {
    attack = [&](const Datagram& overheard) -> std::vector<Datagram> {
      if (overheard.channel != kKeyframeChannel) return {};
      wire::ChunkMessage piece = lcm_port::decode_chunk(message_in(overheard)).value();
      for (std::uint8_t& byte : piece.data) byte = static_cast<std::uint8_t>(~byte);
      return every_way(scene, overheard, kKeyframeChannel, {lcm_port::encode(piece)});
    };
  }
  SECTION("a bit of an overheard datagram flipped") {
    attack = [bit = std::size_t{0}](const Datagram& overheard) mutable -> std::vector<Datagram> {
      bit = (bit + 7919) % (overheard.bytes.size() * 8);
      return {{overheard.channel, lcm_port::lcm_test::with_flipped(overheard.bytes, bit)}};
    };
  }
  SECTION("a code cut short, or left out") {
    attack = [](const Datagram& overheard) {
      std::vector<Datagram> forged;
      for (const std::ptrdiff_t left_out : {1, 8, 15, 16, 17}) {
        const Data& bytes = overheard.bytes;
        forged.push_back({overheard.channel, Data(bytes.begin(), bytes.end() - left_out)});
      }
      return forged;
    };
  }
  SECTION("an overheard message on another channel") {
    attack = [](const Datagram& overheard) {
      std::vector<Datagram> forged;
      for (const std::string_view channel : {kSessionChannel, kKeyframeChannel, kStoredChannel}) {
        if (channel != overheard.channel) forged.push_back({std::string(channel), overheard.bytes});
      }
      return forged;
    };
  }
  SECTION("two hundred sessions, announced first") {
    attack = [&, sessions = 200U](const Datagram& overheard) mutable {
      std::vector<Data> messages;
      for (; sessions > 0; --sessions) {
        const SessionInfo info{{sessions, sessions}, "forged", "os1-64"};
        messages.push_back(lcm_port::encode(wire::SessionMessage{info, {}, 0, 0}));
      }
      return every_way(scene, overheard, kSessionChannel, messages);
    };
  }
  SECTION("its end announced, or its name changed") {
    attack = [&](const Datagram& overheard) {
      std::vector<Data> messages;
      for (const auto state : {wire::SessionState::kStarted, wire::SessionState::kEnded}) {
        const SessionInfo info{victim, "renamed", "os1-64"};
        messages.push_back(lcm_port::encode(wire::SessionMessage{info, state, 1000, 0}));
      }
      return every_way(scene, overheard, kSessionChannel, messages);
    };
  }
  SECTION("other keyframes of the same numbers, sent first") {
    attack = [&, sequence = 0U](const Datagram& overheard) mutable {
      return every_way(scene, overheard, kKeyframeChannel,
                       forged_keyframe(victim, sequence++ % kKeyframes));
    };
  }
  SECTION("valid keyframes of 32 images") {
    attack = [&, sequence = 100U](const Datagram& overheard) mutable {
      return every_way(scene, overheard, kKeyframeChannel, forged_keyframe(victim, sequence++, 32));
    };
  }
  SECTION("everything that was ever heard, again") {
    attack = [heard = std::vector<Datagram>()](const Datagram& overheard) mutable {
      const std::vector<Datagram> before = heard;
      heard.push_back(overheard);
      return before;
    };
  }
  SECTION("answers sent back to their sender, and a robot's own to itself") {
    attack = [](const Datagram& overheard) -> std::vector<Datagram> {
      const bool is_answer = overheard.channel == kStoredChannel;
      return {{std::string(is_answer ? kSessionChannel : kStoredChannel), overheard.bytes}};
    };
  }
  drive(scene.robot, scene.base, attack);
  const std::uint64_t refused =
      scene.base.guard.counters().refused() + scene.robot.guard.counters().refused();
  CHECK(refused > kKeyframes);
  check_whole(scene.robot, scene.base);
}

TEST_CASE("a forged acknowledgement makes no robot forget a keyframe") {
  Scene scene;
  wire::StoredMessage everything;
  everything.session = scene.robot.info.id;
  everything.below = everything.first = everything.until = 1000;
  everything.ended = true;
  const Datagram overheard{
      std::string(kStoredChannel),
      scene.base.guard.seal(kStoredChannel, lcm_port::encode(everything)).value()};
  for (const Datagram& forged :
       every_way(scene, overheard, kStoredChannel, {lcm_port::encode(everything)})) {
    scene.robot.hear(forged);
  }
  CHECK(scene.robot.outbox.size() == kKeyframes);
  CHECK(scene.robot.guard.counters().accepted == 0);
  // What the base itself says counts.
  scene.robot.hear(overheard);
  CHECK(scene.robot.outbox.size() == 0);
}

TEST_CASE("no forger gives a robot a wrong place in the map") {
  Scene scene;
  const auto seal = [&](std::uint32_t sequence) -> Datagram {
    const auto message = lcm_port::encode(map_pose_of(scene.robot.info.id, 3, sequence));
    return {std::string(kMapPoseChannel), scene.base.guard.seal(kMapPoseChannel, message).value()};
  };
  const Datagram overheard = seal(5);
  const Data wrong = lcm_port::encode(map_pose_of(scene.robot.info.id, 4, 999));
  for (const Datagram& forged : every_way(scene, overheard, kMapPoseChannel, {wrong})) {
    scene.robot.hear(forged);
  }
  CHECK_FALSE(scene.robot.map_pose.latest());
  CHECK(scene.robot.guard.counters().accepted == 0);
  // What the base itself says counts, once: sent again, it is no younger than it was.
  scene.robot.hear(overheard);
  REQUIRE(scene.robot.map_pose.latest());
  CHECK(scene.robot.map_pose.latest()->message.sequence == 5);
  scene.robot.hear(overheard);
  CHECK(scene.robot.guard.counters().replayed == 1);
  CHECK(scene.robot.map_pose.counters().taken == 1);
}

TEST_CASE("a robot with a key speaks for itself alone") {
  Scene scene;
  for (const Data& message : forged_keyframe(scene.robot.info.id, 0)) {
    scene.base.hear(
        {std::string(kKeyframeChannel), coded(scene.other, {5, 5}, kKeyframeChannel, message)});
  }
  CHECK(scene.base.guard.counters().other_robot > 0);
  CHECK(scene.base.guard.counters().accepted == 0);
  CHECK(scene.base.receiver.take_sessions().empty());
  RobotGuard guard(scene.other, {5, 5});
  CHECK_FALSE(guard.seal(kKeyframeChannel, scene.robot.messages[0][0]).has_value());
}

TEST_CASE("who has a robot's link key but not its signing key adds no keyframe") {
  Scene scene;
  RobotGuard stolen(scene.key, {7, 7});
  const auto send = [&](const std::vector<Data>& messages) {
    for (const Data& message : messages) {
      scene.base.hear(
          {std::string(kKeyframeChannel), stolen.seal(kKeyframeChannel, message).value()});
    }
  };
  send(forged_keyframe(scene.robot.info.id, 0));
  CHECK(scene.base.guard.counters().unsigned_keyframes == 1);
  // Nor with the signature of another keyframe.
  send(scene.robot.messages[1]);
  Data mixed = scene.robot.plain(2);
  Data signed_one = scene.robot.plain(1);
  scene.robot.signer.sign(signed_one);
  mixed.insert(mixed.end(), signed_one.end() - 68, signed_one.end());
  send(lcm_port::cut_into_messages({scene.robot.info.id, 2, 0, mixed}, 60000));
  CHECK(scene.base.guard.counters().unsigned_keyframes == 2);
  const auto sessions = scene.base.receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  REQUIRE(sessions[0].keyframes.size() == 1);
  CHECK(sessions[0].keyframes[0].sequence == 1);
  CHECK(sessions[0].keyframes_damaged == 2);
}

TEST_CASE("nothing of a revoked robot, of an unknown one, or without a code is heard") {
  Scene scene;
  BaseKey revoked = base_key_of(scene.key);
  revoked.revoked = true;
  SECTION("revoked") {
    Base base({revoked});
    drive(scene.robot, base, no_attack, 2);
    CHECK(base.guard.counters().revoked > kKeyframes);
    CHECK(base.guard.counters().accepted == 0);
    CHECK(base.receiver.take_sessions().empty());
    CHECK_FALSE(base.guard.seal(kStoredChannel, scene.robot.messages[0][0]).has_value());
  }
  SECTION("unknown") {
    Base base({base_key_of(scene.other)});
    drive(scene.robot, base, no_attack, 2);
    CHECK(base.guard.counters().unknown_robot > kKeyframes);
    CHECK(base.receiver.take_sessions().empty());
  }
  SECTION("without a code") {
    for (const Data& message : scene.robot.messages[0]) {
      scene.base.hear({std::string(kKeyframeChannel), message});
    }
    CHECK(scene.base.guard.counters().without_code == scene.robot.messages[0].size());
    CHECK(scene.base.receiver.take_sessions().empty());
  }
  CHECK(scene.robot.outbox.size() == kKeyframes);
}

TEST_CASE("a base that restarts is answered, and an answer of before is true or late") {
  Scene scene;
  drive(scene.robot, scene.base);
  CHECK(scene.robot.outbox.size() == 0);
  Base restarted({base_key_of(scene.key)}, {10, 10});
  Robot again(scene.key, {3, 3});
  again.make(kKeyframes);
  drive(again, restarted);
  check_whole(again, restarted);
}

TEST_CASE("a start of a robot among many is still heard, and its old datagrams are not") {
  Scene scene;
  const Datagram first = scene.robot.session(wire::SessionState::kStarted);
  scene.base.hear(first);
  for (std::uint64_t boot = 1; boot < SeenDatagrams::kMaxBoots; ++boot) {
    scene.base.hear(Robot(scene.key, {1, boot}).session(wire::SessionState::kStarted));
  }
  const GuardCounters before = scene.base.guard.counters();
  CHECK(before.accepted == SeenDatagrams::kMaxBoots);
  scene.base.hear(first);
  CHECK(scene.base.guard.counters().replayed == 1);
  scene.base.hear(scene.robot.session(wire::SessionState::kRunning));
  CHECK(scene.base.guard.counters().accepted == before.accepted + 1);
}

TEST_CASE("a key that is revoked while a base listens counts within a second") {
  const TemporaryDirectory directory;
  const RobotKey key = new_robot_key("robot");
  add_base_key(directory / "keys", base_key_of(key));
  BaseGuard guard(directory / "keys", {9, 9});
  Robot robot(key, kBoot);
  const auto accepted = [&] {
    const Datagram datagram = robot.session(wire::SessionState::kRunning);
    return guard.open(datagram.channel, datagram.bytes).has_value();
  };
  REQUIRE(accepted());
  revoke_base_key(directory / "keys", "robot");
  for (int i = 0; i < 500 && accepted(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  CHECK_FALSE(accepted());
  CHECK(guard.counters().revoked > 0);
}
