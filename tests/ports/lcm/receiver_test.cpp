// Tests of the receiver.
#include "ports/lcm/receiver.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "ports/lcm/event_log.hpp"
#include "ports/lcm/keyframe_codec.hpp"
#include "ports/lcm/session_log.hpp"
#include "tests/ports/lcm/stream.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using test::Message;
using test::Random;
using test::TemporaryDirectory;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};

void feed(Receiver& receiver, const std::vector<Message>& stream) {
  for (const Message& message : stream) receiver.receive(message.channel, message.data);
}

/// All keyframes arrived, in order, with the bytes they were sent with.
void check_whole(const SessionData& data, const SessionInfo& info, std::size_t keyframes) {
  CHECK(data.info.name == info.name);
  CHECK(data.info.sensor == info.sensor);
  CHECK(data.info.id == info.id);
  CHECK(data.complete);
  CHECK(data.keyframes_missing == 0);
  CHECK(data.keyframes_damaged == 0);
  REQUIRE(data.keyframes.size() == keyframes);
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    CHECK(data.keyframes[i].sequence == i);
    CHECK(encode_keyframe(data.keyframes[i]) == encode_keyframe(test::keyframe_of(info.id, i)));
  }
}

}  // namespace

TEST_CASE("a session arrives as it was sent") {
  Receiver receiver;
  feed(receiver, test::session_stream(kAlpha, 5));
  REQUIRE(receiver.progress().size() == 1);
  CHECK(receiver.progress()[0].ended);
  CHECK(receiver.progress()[0].whole);
  const auto sessions = receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  check_whole(sessions[0], kAlpha, 5);
  CHECK(receiver.counters().keyframes == 5);
  CHECK(receiver.counters().malformed == 0);
  CHECK(receiver.take_sessions().empty());
}

TEST_CASE("order, repetition and interleaving do not matter") {
  std::vector<Message> stream = test::session_stream(kAlpha, 6);
  for (const Message& message : test::session_stream(kBeta, 4)) stream.push_back(message);
  const std::size_t once = stream.size();
  for (std::size_t i = 0; i < once; ++i) stream.push_back(stream[i]);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    test::shuffle(stream, random);
    Receiver receiver;
    feed(receiver, stream);
    CHECK(receiver.counters().pieces_duplicate > 0);
    const auto sessions = receiver.take_sessions();
    REQUIRE(sessions.size() == 2);
    check_whole(sessions[0], kAlpha, 6);
    check_whole(sessions[1], kBeta, 4);
  }
}

TEST_CASE("a lost piece costs its keyframe, and the gap is seen") {
  std::vector<Message> stream = test::session_stream(kAlpha, 5);
  const std::size_t pieces = test::pieces(test::keyframe_of(kAlpha.id, 0)).size();
  REQUIRE(pieces > 2);
  stream.erase(stream.begin() + 2);  // the first keyframe's second piece
  Receiver receiver;
  feed(receiver, stream);
  CHECK(receiver.progress()[0].ended);
  CHECK_FALSE(receiver.progress()[0].whole);
  const auto sessions = receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].keyframes.size() == 4);
  CHECK(sessions[0].keyframes[0].sequence == 1);
  CHECK(sessions[0].keyframes_missing == 1);
}

TEST_CASE("keyframes of which nothing arrives are missed all the same") {
  SECTION("in the middle, by their numbers") {
    Receiver receiver;
    for (std::uint32_t sequence : {0U, 4U}) {
      feed(receiver, test::pieces(test::keyframe_of(kAlpha.id, sequence)));
    }
    const auto sessions = receiver.take_sessions();
    CHECK(sessions[0].keyframes_missing == 3);
    CHECK_FALSE(sessions[0].complete);
    CHECK(sessions[0].info.name == "robot1_session11");
  }
  SECTION("at the end, by the session's last message") {
    Receiver receiver;
    feed(receiver, test::pieces(test::keyframe_of(kAlpha.id, 0)));
    feed(receiver, {test::session_message(kAlpha, SessionState::kEnded, 10)});
    CHECK(receiver.take_sessions()[0].keyframes_missing == 9);
  }
  SECTION("by a first piece whose successors never come") {
    Receiver receiver;
    feed(receiver, {test::pieces(test::keyframe_of(kAlpha.id, 2))[0]});
    CHECK(receiver.take_sessions()[0].keyframes_missing == 3);
  }
}

TEST_CASE("what the robot itself dropped is missing, but not waited for") {
  Receiver receiver;
  feed(receiver, test::pieces(test::keyframe_of(kAlpha.id, 1)));
  feed(receiver, {test::session_message(kAlpha, SessionState::kEnded, 2, 1)});
  CHECK(receiver.progress()[0].whole);
  CHECK(receiver.take_sessions()[0].keyframes_missing == 1);
}

TEST_CASE("a late keyframe fills its gap") {
  Receiver receiver;
  std::vector<Message> late = test::pieces(test::keyframe_of(kAlpha.id, 0));
  feed(receiver, test::pieces(test::keyframe_of(kAlpha.id, 1)));
  feed(receiver, {test::session_message(kAlpha, SessionState::kEnded, 2)});
  CHECK_FALSE(receiver.progress()[0].whole);
  feed(receiver, late);
  CHECK(receiver.progress()[0].whole);
  CHECK(receiver.take_sessions()[0].keyframes_missing == 0);
}

TEST_CASE("bytes that arrive whole but are no keyframe count as damaged, until a good one comes") {
  const KeyframeRecord record = test::keyframe_of(kAlpha.id, 0);
  EncodedKeyframe broken = encode_for_sending(record);
  broken.bytes[0] = 'X';
  Receiver receiver;
  for (const auto& data : cut_into_messages(broken, 512)) receiver.receive(kKeyframeChannel, data);
  CHECK(receiver.counters().keyframes_damaged == 1);
  SECTION("and stays damaged") {
    const auto sessions = receiver.take_sessions();
    CHECK(sessions[0].keyframes.empty());
    CHECK(sessions[0].keyframes_damaged == 1);
    CHECK(sessions[0].keyframes_missing == 0);
  }
  SECTION("and is replaced") {
    feed(receiver, test::pieces(record));
    const auto sessions = receiver.take_sessions();
    CHECK(sessions[0].keyframes.size() == 1);
    CHECK(sessions[0].keyframes_damaged == 0);
  }
}

TEST_CASE("an envelope cannot claim another robot's keyframe") {
  EncodedKeyframe stolen = encode_for_sending(test::keyframe_of(kAlpha.id, 0));
  stolen.session = kBeta.id;
  Receiver receiver;
  for (const auto& data : cut_into_messages(stolen, 512)) receiver.receive(kKeyframeChannel, data);
  CHECK(receiver.counters().keyframes == 0);
  CHECK(receiver.counters().keyframes_damaged == 1);
}

TEST_CASE("forged pieces cannot spoil a keyframe under way") {
  const KeyframeRecord record = test::keyframe_of(kAlpha.id, 0);
  const std::vector<Message> good = test::pieces(record);
  EncodedKeyframe forged = encode_for_sending(record);
  for (auto& byte : forged.bytes) byte = static_cast<std::uint8_t>(~byte);
  const auto bad = cut_into_messages(forged, 512);
  REQUIRE(bad.size() == good.size());
  Receiver receiver;
  for (std::size_t i = 0; i < good.size(); ++i) {
    if (i + 1 < good.size()) receiver.receive(kKeyframeChannel, bad[i]);
    receiver.receive(kKeyframeChannel, good[i].data);
  }
  CHECK(receiver.counters().keyframes == 1);
}

TEST_CASE("a flood of unfinished keyframes stays within its bound and gives up the oldest") {
  ReceiverLimits limits;
  limits.max_pending_keyframes = 8;
  limits.max_pending_bytes = 100000;
  Reassembly reassembly(limits);
  ChunkMessage chunk;
  chunk.count = 1000;
  chunk.total_bytes = 1000 * 400;
  chunk.data.assign(400, 0);
  for (std::uint32_t sequence = 0; sequence < 1000; ++sequence) {
    chunk.sequence = sequence % 100;
    chunk.index = sequence;
    reassembly.add(ChunkMessage(chunk));
    REQUIRE(reassembly.pending_keyframes() <= 8);
    REQUIRE(reassembly.pending_bytes() <= 100000);
  }
  CHECK(reassembly.given_up() > 900);
  // One keyframe alone may not exceed the bound either.
  chunk.sequence = 5000;
  for (chunk.index = 0; chunk.index < 999; ++chunk.index) {
    reassembly.add(ChunkMessage(chunk));
    REQUIRE(reassembly.pending_bytes() <= 100000);
  }
}

TEST_CASE("one-byte pieces are not free") {
  ReceiverLimits limits;
  limits.max_pending_bytes = 10000;
  Reassembly reassembly(limits);
  ChunkMessage chunk;
  chunk.count = 1U << 20U;
  chunk.total_bytes = 1U << 20U;
  chunk.data.assign(1, 0);
  for (chunk.index = 0; chunk.index < 1000; ++chunk.index) reassembly.add(ChunkMessage(chunk));
  CHECK(reassembly.given_up() > 0);
}

TEST_CASE("limits refuse and count") {
  SECTION("a keyframe too large") {
    ReceiverLimits limits;
    limits.max_keyframe_bytes = 1000;
    Receiver receiver(limits);
    feed(receiver, test::pieces(test::keyframe_of(kAlpha.id, 0)));
    CHECK(receiver.counters().keyframes == 0);
    CHECK(receiver.counters().refused > 0);
  }
  SECTION("a session too many") {
    ReceiverLimits limits;
    limits.max_sessions = 1;
    Receiver receiver(limits);
    feed(receiver, test::session_stream(kAlpha, 1));
    feed(receiver, test::session_stream(kBeta, 1));
    CHECK(receiver.counters().refused > 0);
    CHECK(receiver.take_sessions().size() == 1);
  }
  SECTION("too much to store") {
    ReceiverLimits limits;
    limits.max_stored_bytes = 50000;
    Receiver receiver(limits);
    feed(receiver, test::session_stream(kAlpha, 30));
    CHECK(receiver.counters().refused > 0);
    CHECK(receiver.counters().keyframes > 0);
    CHECK(receiver.counters().keyframes < 30);
  }
}

TEST_CASE("rubbish on every channel is counted and harmless") {
  Random random(9);
  Receiver receiver;
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::uint8_t> data(random.below(200));
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random.bits());
    const std::string_view channels[] = {kSessionChannel, kKeyframeChannel, kHealthChannel,
                                         "SOMETHING_ELSE"};
    receiver.receive(channels[random.below(4)], data);
  }
  const ReceiverCounters counters = receiver.counters();
  CHECK(counters.malformed == counters.messages);
  CHECK(counters.foreign + counters.messages == 20000);
  CHECK(receiver.take_sessions().empty());
}

TEST_CASE("a session keeps its first name") {
  Receiver receiver;
  SessionInfo liar = kAlpha;
  liar.name = "omega";
  feed(receiver, test::session_stream(kAlpha, 1));
  feed(receiver, {test::session_message(liar, SessionState::kEnded, 100)});
  CHECK(receiver.counters().contradictory == 1);
  const auto sessions = receiver.take_sessions();
  CHECK(sessions[0].info.name == "alpha");
  CHECK(sessions[0].keyframes_missing == 0);
}

TEST_CASE("sessions are sorted, and equal names are told apart") {
  std::vector<SessionData> sessions(4);
  sessions[0].info = {{2, 5}, "town", ""};
  sessions[1].info = {{1, 9}, "town", ""};
  sessions[2].info = {{3, 1}, "alley", ""};
  sessions[3].info = {{1, 8}, "town", ""};
  sort_and_name(sessions);
  CHECK(sessions[0].info.name == "alley");
  CHECK(sessions[1].info.name == "town");
  CHECK(sessions[1].info.id == SessionId{1, 8});
  CHECK(sessions[2].info.name == "town-2");
  CHECK(sessions[3].info.name == "town-3");
  CHECK(sessions[3].info.id == SessionId{2, 5});
}

TEST_CASE("health is kept per session, the latest") {
  Receiver receiver;
  feed(receiver, test::session_stream(kAlpha, 1));
  HealthMessage health;
  health.session = kAlpha.id;
  for (std::uint64_t scans : {10U, 20U}) {
    health.scans = scans;
    receiver.receive(kHealthChannel, encode(health));
  }
  REQUIRE(receiver.progress()[0].health.has_value());
  CHECK(receiver.progress()[0].health->scans == 20);
}

// ---- event logs

namespace {

void write_log(const std::filesystem::path& path, const SessionInfo& info,
               std::uint32_t keyframes) {
  SessionLogWriter writer(path, info, 2000);
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    writer.write(encode_for_sending(test::keyframe_of(info.id, i)));
  }
  writer.finish();
}

std::vector<char> content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace

TEST_CASE("a session goes through an event log unchanged") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 4);
  const ReceivedLog log = read_event_log(directory / "log");
  CHECK(log.faults.empty());
  REQUIRE(log.sessions.size() == 1);
  check_whole(log.sessions[0], kAlpha, 4);
}

TEST_CASE("equal keyframes give equal logs") {
  const TemporaryDirectory directory;
  write_log(directory / "a", kAlpha, 3);
  write_log(directory / "b", kAlpha, 3);
  CHECK(content(directory / "a") == content(directory / "b"));
}

TEST_CASE("a session without keyframes leaves a log with its name") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 0);
  const ReceivedLog log = read_event_log(directory / "log");
  REQUIRE(log.sessions.size() == 1);
  check_whole(log.sessions[0], kAlpha, 0);
}

TEST_CASE("several logs can be one stream, and other channels in them are skipped") {
  const TemporaryDirectory directory;
  std::vector<Message> stream = test::session_stream(kAlpha, 3);
  {
    EventLogWriter first(directory / "first");
    EventLogWriter second(directory / "second");
    for (std::size_t i = 0; i < stream.size(); ++i) {
      EventLogWriter& log = i % 2 == 0 ? first : second;
      log.write(static_cast<std::int64_t>(i), stream[i].channel, stream[i].data);
      log.write(static_cast<std::int64_t>(i), "CAMERA", std::vector<std::uint8_t>(100, 1));
    }
  }
  Receiver receiver;
  CHECK(feed_event_log(receiver, directory / "first").empty());
  CHECK(feed_event_log(receiver, directory / "second").empty());
  CHECK(receiver.counters().foreign == stream.size());
  check_whole(receiver.take_sessions().at(0), kAlpha, 3);
}

TEST_CASE("a torn log gives every keyframe that is whole in it") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 4);
  const std::vector<char> bytes = content(directory / "log");
  test::MemoryFile torn;
  std::size_t last_keyframes = 0;
  for (std::size_t length = 0; length < bytes.size(); length += 37) {
    torn.write(bytes.data(), length);
    const ReceivedLog log = read_event_log(torn.path());
    const std::size_t keyframes = log.sessions.empty() ? 0 : log.sessions[0].keyframes.size();
    CHECK(keyframes >= last_keyframes);
    last_keyframes = keyframes;
    if (!log.sessions.empty()) CHECK_FALSE(log.sessions[0].complete);
  }
  CHECK(last_keyframes >= 3);
}

TEST_CASE("no flipped bit in a log gets an altered keyframe through") {
  const TemporaryDirectory directory;
  write_log(directory / "log", kAlpha, 2);
  const std::vector<char> bytes = content(directory / "log");
  test::MemoryFile file;
  Random random(12);
  for (int i = 0; i < 500; ++i) {
    std::vector<char> damaged = bytes;
    const std::uint32_t at = random.below(static_cast<std::uint32_t>(bytes.size()));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.below(8)));
    file.write(damaged.data(), damaged.size());
    for (const SessionData& session : read_event_log(file.path()).sessions) {
      for (const KeyframeRecord& record : session.keyframes) {
        REQUIRE(encode_keyframe(record) ==
                encode_keyframe(test::keyframe_of(kAlpha.id, record.sequence)));
      }
    }
  }
}
