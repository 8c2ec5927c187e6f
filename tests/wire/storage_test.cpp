// Tests of a receiver whose keyframes go to a storage: what is said when, quotas, restarts.
#include "tests/test.hpp"
#include "tests/wire/receiving.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/receiver.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::wire::wire_test;

namespace {

/// A storage that commits when it is told to.
class ManualStorage final : public KeyframeStorage {
 public:
  Taken keep(ReceivedKeyframe&& keyframe) override {
    if (is_full) return Taken::kNoRoom;
    const KeyframeName name{keyframe.record.session, keyframe.record.sequence};
    REQUIRE(stored.count(name) == 0);
    REQUIRE(waiting.emplace(name, keyframe.bytes.size()).second);
    return Taken::kWaiting;
  }
  void keep(ReceivedSummary&& summary) override {
    const KeyframeName name{summary.record.session, summary.record.sequence};
    REQUIRE(summary.record.is_summary);
    REQUIRE(keyframe_summaries.emplace(name, summary.bytes).second);
  }
  void remove_summary(const KeyframeName& name) override { keyframe_summaries.erase(name); }
  void keep(const SessionSummary& summary) override { summaries_waiting[summary.id] = summary; }
  void keep(const HealthMessage& health) override { healths.push_back(health); }
  Committed commit_due(std::int64_t /*now_ns*/) override {
    Committed committed;
    if (!commits) return committed;
    for (const auto& [name, bytes] : waiting) committed.keyframes.push_back(name);
    for (const auto& [id, summary] : summaries_waiting) {
      committed.sessions.push_back(summary);
      summaries[id] = summary;
    }
    stored.merge(waiting);
    waiting.clear();
    summaries_waiting.clear();
    return committed;
  }
  Committed commit_all(std::int64_t now_ns) override { return commit_due(now_ns); }
  std::optional<StoredSession> find(const SessionId& id) override {
    if (!is_readable) return std::nullopt;
    StoredSession session;
    if (summaries.count(id) > 0) session.summary = summaries[id];
    session.summary.id = id;
    for (const auto& [name, bytes] : stored) {
      if (name.session == id) session.keyframes.insert(name.sequence);
    }
    for (const auto& [name, bytes] : keyframe_summaries) {
      if (name.session != id || stored.contains(name)) continue;
      session.summaries[name.sequence] = {static_cast<std::uint32_t>(bytes.size()), crc32(bytes)};
    }
    return session;
  }
  [[nodiscard]] std::vector<RobotUsage> usage() const override {
    std::map<std::uint32_t, RobotUsage> robots;
    std::set<SessionId> sessions;
    for (const auto& [name, bytes] : stored) {
      RobotUsage& robot = robots[name.session.robot];
      robot.robot = name.session.robot;
      robot.bytes += bytes;
      robot.sessions += sessions.insert(name.session).second ? 1 : 0;
    }
    std::vector<RobotUsage> all;
    for (const auto& [number, robot] : robots) all.push_back(robot);
    return all;
  }
  [[nodiscard]] bool accepts() const override { return commits; }
  [[nodiscard]] bool is_durable() const override { return true; }

  bool commits = true;
  bool is_full = false;
  bool is_readable = true;
  std::map<KeyframeName, std::uint64_t> waiting;
  std::map<KeyframeName, std::uint64_t> stored;
  std::map<SessionId, SessionSummary> summaries_waiting;
  std::map<SessionId, SessionSummary> summaries;
  std::map<KeyframeName, std::vector<std::uint8_t>> keyframe_summaries;
  std::vector<HealthMessage> healths;
};

/// The only answer.
StoredMessage answer(Receiver& receiver) {
  const std::vector<StoredMessage> messages = receiver.take_stored();
  REQUIRE(messages.size() == 1);
  return messages.front();
}

std::uint64_t encoded_bytes(const SessionId& id, std::uint32_t sequence) {
  return encode_keyframe(keyframe_of(id, sequence)).size();
}

}  // namespace

TEST_CASE("a keyframe and an end are acknowledged after their commit, and not before") {
  ManualStorage storage;
  storage.commits = false;
  Receiver receiver({}, storage);
  feed(receiver, session_stream(kAlpha, 3));
  receiver.advance(1);
  const StoredMessage before = answer(receiver);
  CHECK(before.below == 0);
  // Nor is anything called missing: a robot would resend what the base has.
  CHECK(before.until == before.first);
  CHECK_FALSE(before.ended);
  CHECK(receiver.counters().keyframes == 0);
  CHECK(receiver.progress()[0].waiting == 3);
  // Resent all the same, it is not handed over twice: the storage would say so.
  feed(receiver, session_stream(kAlpha, 3));

  storage.commits = true;
  receiver.advance(2);
  const StoredMessage after = answer(receiver);
  CHECK(after.below == 3);
  CHECK(after.ended);
  CHECK(receiver.counters().keyframes == 3);
  CHECK(receiver.progress()[0].whole);
  CHECK(receiver.take_stored().empty());
  CHECK(storage.summaries.at(kAlpha.id).info->name == "alpha");
}

TEST_CASE("what does not fit is refused, counted and taken later") {
  ManualStorage storage;
  storage.is_full = true;
  Receiver receiver({}, storage);
  feed(receiver, pieces(kAlpha.id, 0));
  CHECK(receiver.counters().refused == 1);
  CHECK(receiver.progress()[0].refused == 1);
  storage.is_full = false;
  feed(receiver, pieces(kAlpha.id, 0));
  receiver.advance(1);
  CHECK(answer(receiver).below == 1);
}

TEST_CASE("a base that starts again goes on where it was") {
  ManualStorage storage;
  {
    Receiver receiver({}, storage);
    say(receiver, SessionState::kRunning, 9, 2);
    for (const std::uint32_t sequence : {0U, 1U, 5U}) {
      feed(receiver, pieces(kAlpha.id, sequence));
    }
    receiver.advance(1);
  }
  Receiver receiver({}, storage);
  CHECK(receiver.progress().empty());
  feed(receiver, pieces(kAlpha.id, 1));
  CHECK(receiver.counters().pieces_duplicate > 0);
  const StoredMessage message = answer(receiver);
  CHECK(message.below == 2);
  REQUIRE(message.ranges.size() == 1);
  CHECK(message.ranges[0].begin == 5);
  const SessionProgress progress = receiver.progress().at(0);
  CHECK(progress.info.name == "alpha");
  CHECK(progress.announced == 9);
  CHECK(progress.received == 3);
}

TEST_CASE("a summary is kept once, survives a restart, and counts until its keyframe comes") {
  ManualStorage storage;
  const KeyframeRecord record = keyframe_of(kAlpha.id, 3);
  std::uint64_t summary = 0;
  {
    Receiver receiver({}, storage);
    feed(receiver, all_but_last_piece(record));
    receiver.advance(1);
    REQUIRE(storage.keyframe_summaries.size() == 1);
    summary = storage.keyframe_summaries.begin()->second.size();
    // The session is one that the storage knows.
    CHECK(storage.summaries.count(kAlpha.id) == 1);
  }
  Receiver receiver(ReceiverLimits{.robot = {.bytes = encoded_bytes(kAlpha.id, 3) + summary - 1}},
                    storage);
  feed(receiver, all_but_last_piece(record));  // the storage would say if it came again
  CHECK(receiver.progress()[0].summaries == 1);
  feed(receiver, pieces(record).back());
  receiver.advance(2);
  CHECK(storage.stored.count({kAlpha.id, 3}) == 1);
  CHECK(receiver.progress()[0].summaries == 0);
}

TEST_CASE("a session that cannot be read now is not taken for a new one") {
  ManualStorage storage;
  {
    Receiver receiver({}, storage);
    feed(receiver, pieces(kAlpha.id, 0));
    receiver.advance(1);
  }
  storage.is_readable = false;
  Receiver receiver({}, storage);
  feed(receiver, pieces(kAlpha.id, 0));
  CHECK(receiver.progress().empty());
  CHECK(receiver.take_stored().empty());
  CHECK(receiver.counters().refused > 0);
}

TEST_CASE("of more sessions than are followed at once, none is forgotten for good") {
  ManualStorage storage;
  Receiver receiver(limited(&ReceiverLimits::max_sessions, 2), storage);
  std::int64_t now = 0;
  for (std::uint32_t round = 0; round < 3; ++round) {
    for (std::uint64_t session = 0; session < 5; ++session) {
      feed(receiver, pieces({1, session}, round));
      receiver.advance(++now);
      CHECK(receiver.progress().size() <= 2);
    }
  }
  CHECK(storage.stored.size() == 15);
  CHECK(receiver.counters().refused == 0);
}

TEST_CASE("health is kept of sessions with keyframes only") {
  ManualStorage storage;
  Receiver receiver({}, storage);
  HealthMessage health;
  health.session = kAlpha.id;
  feed(receiver, Message(health));
  CHECK(storage.healths.empty());
  feed(receiver, pieces(kAlpha.id, 0));
  feed(receiver, Message(health));
  CHECK(storage.healths.size() == 1);
}

TEST_CASE("a robot beyond its quota of bytes is refused, another is not") {
  ManualStorage storage;
  ReceiverLimits limits;
  limits.robot.bytes = encoded_bytes(kAlpha.id, 0) + encoded_bytes(kAlpha.id, 1);
  {
    Receiver receiver(limits, storage);
    feed(receiver, session_stream(kAlpha, 3));
    receiver.advance(1);
    CHECK(storage.stored.size() == 2);
    const StoredMessage message = answer(receiver);
    CHECK(message.below == 2);
    // The robot is not asked for what it would send in vain.
    CHECK(message.until == message.first);
    CHECK(receiver.progress()[0].refused > 0);
  }
  // What was stored counts after a restart, too, and other sessions of the robot as well.
  Receiver receiver(limits, storage);
  feed(receiver, pieces({kAlpha.id.robot, 12}, 0));
  feed(receiver, pieces(kBeta.id, 0));
  receiver.advance(1);
  CHECK(storage.stored.size() == 3);
  CHECK(storage.stored.count({kBeta.id, 0}) == 1);
}

TEST_CASE("a robot beyond its quota of sessions goes on with those it has, summaries counted") {
  ManualStorage storage;
  Receiver receiver(ReceiverLimits{.robot = {.sessions = 2}}, storage);
  for (std::uint64_t session = 0; session < 4; ++session) {
    feed(receiver, all_but_last_piece(keyframe_of({1, session}, 0)));
  }
  CHECK(storage.keyframe_summaries.size() == 2);
  CHECK(receiver.counters().refused > 0);
  for (std::uint64_t session = 0; session < 4; ++session) {
    feed(receiver, pieces({1, session}, 0));
  }
  feed(receiver, pieces({1, 1}, 1));
  feed(receiver, pieces({2, 7}, 0));
  receiver.advance(1);
  std::set<KeyframeName> names;
  for (const auto& [name, bytes] : storage.stored) names.insert(name);
  CHECK(names == std::set<KeyframeName>{{{1, 0}, 0}, {{1, 1}, 0}, {{1, 1}, 1}, {{2, 7}, 0}});
}

TEST_CASE("a robot that sends too fast is taken at its rate, and all of it in the end") {
  constexpr std::int64_t kSecondNs = 1'000'000'000;
  ManualStorage storage;
  // Ten seconds' worth may come at once.
  const double rate = static_cast<double>(encoded_bytes(kAlpha.id, 0)) / 4.0;
  Receiver receiver(ReceiverLimits{.robot = {.bytes_per_second = rate}}, storage);
  const auto send_all = [&](std::int64_t now_ns) {
    receiver.advance(now_ns);
    for (std::uint32_t sequence = 0; sequence < 8; ++sequence) {
      feed(receiver, pieces(kAlpha.id, sequence));
    }
    feed(receiver, pieces(kBeta.id, 0));
    receiver.advance(now_ns);
  };
  send_all(0);
  CHECK(storage.stored.size() < 5);
  CHECK(storage.stored.count({kBeta.id, 0}) == 1);
  // It is asked for the rest.
  for (const StoredMessage& message : receiver.take_stored()) CHECK(message.until > message.first);
  std::int64_t now_ns = 0;
  for (int second = 0; second < 60 && storage.stored.size() < 9; ++second) {
    send_all(now_ns += kSecondNs);
  }
  CHECK(storage.stored.size() == 9);
  CHECK(now_ns > 10 * kSecondNs);
}

TEST_CASE("a robot's incomplete keyframes are bounded, and cost another robot none") {
  ManualStorage storage;
  Receiver receiver(ReceiverLimits{.robot = {.pending_keyframes = 3}}, storage);
  // Neither has anything stored yet.
  const std::vector<Message> victim = pieces(kAlpha.id, 0);
  ChunkMessage forged = std::get<ChunkMessage>(pieces(kBeta.id, 0)[0]);
  for (const Message& piece : victim) {
    feed(receiver, piece);
    for (std::uint32_t k = 0; k < 100; ++k) {
      forged.sequence = 1000 + k;
      feed(receiver, Message(forged));
    }
  }
  receiver.advance(1);
  CHECK(storage.stored.count({kAlpha.id, 0}) == 1);
  CHECK(receiver.counters().keyframes_abandoned == 100 * victim.size() - 3);
}
