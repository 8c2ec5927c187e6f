// Tests of reassembly and of the receiver of sessions.
#include "unimapper/wire/receiver.hpp"

#include "tests/test.hpp"
#include "tests/wire/receiving.hpp"
#include "tests/wire/whole_session.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/reassembly.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::wire::wire_test;

TEST_CASE("a session arrives as it was sent") {
  Receiver receiver;
  feed(receiver, session_stream(kAlpha, 5));
  REQUIRE(receiver.progress().size() == 1);
  CHECK(receiver.progress()[0].ended);
  CHECK(receiver.progress()[0].whole);
  check_whole(take_session(receiver), kAlpha, 5);
  CHECK(receiver.counters().keyframes == 5);
  CHECK(receiver.counters().malformed == 0);
  CHECK(receiver.take_sessions().empty());
}

TEST_CASE("order, repetition and interleaving do not matter") {
  std::vector<Message> stream = session_stream(kAlpha, 6);
  for (const Message& message : session_stream(kBeta, 4)) stream.push_back(message);
  const std::size_t once = stream.size();
  for (std::size_t i = 0; i < once; ++i) stream.push_back(stream[i]);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    shuffle(stream, random);
    Receiver receiver;
    feed(receiver, stream);
    CHECK(receiver.counters().pieces_duplicate > 0);
    const auto sessions = receiver.take_sessions();
    REQUIRE(sessions.size() == 2);
    check_whole(sessions[0], kAlpha, 6);
    check_whole(sessions[1], kBeta, 4);
  }
}

TEST_CASE("keyframes of which nothing arrives are missed all the same") {
  Receiver receiver;
  SECTION("in the middle, by their numbers") {
    for (std::uint32_t sequence : {0U, 4U}) feed(receiver, pieces(kAlpha.id, sequence));
    const SessionData session = take_session(receiver);
    CHECK(session.keyframes_missing == 3);
    CHECK_FALSE(session.complete);
    CHECK(session.info.name == "robot1_boot0000000000000000000000000000000b");
  }
  SECTION("at the end, by the session's last message") {
    feed(receiver, pieces(kAlpha.id, 0));
    say(receiver, SessionState::kEnded, 10);
    CHECK(take_session(receiver).keyframes_missing == 9);
  }
  SECTION("by a first piece whose successors never come") {
    feed(receiver, pieces(kAlpha.id, 2)[0]);
    CHECK(take_session(receiver).keyframes_missing == 3);
  }
  SECTION("like one that lacks a piece, of a session that ended") {
    std::vector<Message> stream = session_stream(kAlpha, 3);
    stream.erase(stream.begin() + 2);  // the first keyframe's second piece
    feed(receiver, stream);
    CHECK_FALSE(receiver.progress()[0].whole);
    const SessionData session = take_session(receiver);
    CHECK(session.keyframes.size() == 2);
    CHECK(session.keyframes_missing == 1);
  }
  SECTION("but not waited for if the robot dropped them") {
    feed(receiver, pieces(kAlpha.id, 1));
    say(receiver, SessionState::kEnded, 2, 1);
    CHECK(receiver.progress()[0].whole);
    CHECK(take_session(receiver).keyframes_missing == 1);
  }
  SECTION("until they come late") {
    feed(receiver, pieces(kAlpha.id, 1));
    say(receiver, SessionState::kEnded, 2);
    CHECK_FALSE(receiver.progress()[0].whole);
    feed(receiver, pieces(kAlpha.id, 0));
    CHECK(receiver.progress()[0].whole);
    CHECK(take_session(receiver).keyframes_missing == 0);
  }
}

TEST_CASE("bytes that arrive whole but are no keyframe count as damaged, until a good one comes") {
  const KeyframeRecord record = keyframe_of(kAlpha.id, 0);
  EncodedKeyframe broken = encode_for_sending(record);
  broken.bytes[0] = 'X';
  Receiver receiver;
  feed(receiver, pieces_of(broken));
  CHECK(receiver.counters().keyframes_damaged == 1);
  const bool is_replaced = GENERATE(false, true);
  if (is_replaced) feed(receiver, pieces(record));
  const SessionData session = take_session(receiver);
  CHECK(session.keyframes.size() == (is_replaced ? 1 : 0));
  CHECK(session.keyframes_damaged == (is_replaced ? 0 : 1));
  CHECK(session.keyframes_missing == 0);
}

TEST_CASE("pieces cannot claim another robot's keyframe, or one of another number") {
  EncodedKeyframe stolen = encode_for_sending(keyframe_of(kAlpha.id, 0));
  const bool of_robot = GENERATE(true, false);
  if (of_robot) stolen.session = kBeta.id;
  if (!of_robot) stolen.sequence = 1;
  Receiver receiver;
  feed(receiver, pieces_of(stolen));
  CHECK(receiver.counters().keyframes == 0);
  CHECK(receiver.counters().keyframes_damaged == 1);
  const SessionData session = take_session(receiver);
  CHECK(session.keyframes.empty());
  CHECK(session.keyframes_damaged == 1);
}

TEST_CASE("forged pieces cannot spoil a keyframe under way") {
  const std::vector<Message> good = pieces(kAlpha.id, 0);
  EncodedKeyframe forged = encode_for_sending(keyframe_of(kAlpha.id, 0));
  for (auto& byte : forged.bytes) byte = static_cast<std::uint8_t>(~byte);
  const std::vector<Message> bad = pieces_of(forged);
  REQUIRE(bad.size() == good.size());
  Receiver receiver;
  for (std::size_t i = 0; i < good.size(); ++i) {
    if (i + 1 < good.size()) feed(receiver, bad[i]);
    feed(receiver, good[i]);
  }
  CHECK(receiver.counters().keyframes == 1);
}

TEST_CASE("a forged piece under an overheard head cannot spoil a keyframe, first or last") {
  const std::vector<Message> good = pieces(kAlpha.id, 0);
  const bool floods = GENERATE(false, true);
  for (std::size_t at = 0; at < good.size(); ++at) {
    ChunkMessage forged = std::get<ChunkMessage>(good[at]);
    Receiver receiver;
    for (int i = 0; i < (floods ? 20 : 1); ++i) {
      ++forged.data[static_cast<std::size_t>(i) % forged.data.size()];
      feed(receiver, Message(forged));
    }
    feed(receiver, good);
    CHECK(receiver.counters().keyframes == 1);
    CHECK(receiver.take_sessions().at(0).keyframes_damaged == 0);
  }
}

TEST_CASE("two forged pieces of different indices are both seen through") {
  const std::vector<Message> good = pieces(kAlpha.id, 0);
  REQUIRE(good.size() > 4);
  Receiver receiver;
  for (const std::size_t at : {std::size_t{1}, std::size_t{3}}) {
    ChunkMessage forged = std::get<ChunkMessage>(good[at]);
    ++forged.data[0];
    feed(receiver, Message(forged));
  }
  feed(receiver, good);
  CHECK(receiver.counters().keyframes == 1);
}

TEST_CASE("a flood of unfinished keyframes costs its sender, not another robot") {
  Receiver receiver(limited(&ReceiverLimits::max_pending_keyframes, 8));
  const bool many_robots = GENERATE(false, true);
  feed(receiver, pieces(kAlpha.id, 0));
  ChunkMessage forged = std::get<ChunkMessage>(pieces(kBeta.id, 0)[0]);
  for (const Message& piece : pieces(kAlpha.id, 1)) {
    feed(receiver, piece);
    for (std::uint32_t k = 0; k < 20; ++k) {
      forged.sequence = k;
      if (many_robots) forged.session.robot = 100 + k;
      feed(receiver, Message(forged));
    }
  }
  CHECK(receiver.counters().keyframes == 2);
  CHECK(receiver.counters().keyframes_abandoned > 0);
}

TEST_CASE("sessions that only announce themselves lock no robot out") {
  Receiver receiver(limited(&ReceiverLimits::max_sessions, 4));
  feed(receiver, session_stream(kAlpha, 2));
  for (std::uint64_t i = 0; i < 200; ++i) {
    feed(receiver, session_message({{9, i}, "nobody", ""}, SessionState::kStarted, 0));
  }
  feed(receiver, session_stream(kBeta, 3));
  CHECK(receiver.progress().size() == 4);
  const auto sessions = receiver.take_sessions();
  check_whole(sessions.at(0), kAlpha, 2);
  check_whole(sessions.at(1), kBeta, 3);
  CHECK(receiver.counters().refused == 198);
}

TEST_CASE("an end that somebody else announced is taken back by the robot") {
  const std::uint64_t claimed = GENERATE(1U, 1000000U);
  Receiver receiver;
  feed(receiver, pieces(kAlpha.id, 0));
  say(receiver, SessionState::kRunning, 1);
  say(receiver, SessionState::kEnded, claimed);
  CHECK(receiver.progress()[0].ended);
  for (int i = 0; i < 2; ++i) say(receiver, SessionState::kRunning, 2);
  CHECK_FALSE(receiver.progress()[0].ended);
  feed(receiver, pieces(kAlpha.id, 1));
  say(receiver, SessionState::kEnded, 2);
  CHECK(receiver.progress()[0].whole);
  check_whole(take_session(receiver), kAlpha, 2);
}

TEST_CASE("a session's message that is overtaken by a later one takes nothing back") {
  Receiver receiver;
  feed(receiver, pieces(kAlpha.id, 0));
  say(receiver, SessionState::kEnded, 10, 2);
  say(receiver, SessionState::kRunning, 3, 1);
  CHECK(receiver.progress()[0].ended);
  const SessionData session = take_session(receiver);
  CHECK(session.complete);
  CHECK(session.keyframes_missing == 9);
}

TEST_CASE("an end counts from the last sign that the session runs, however often it is said") {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const std::vector<Message> ended = {session_message(kAlpha, SessionState::kEnded, 2)};
  const std::vector<Message> running = {session_message(kAlpha, SessionState::kRunning, 2)};
  Receiver receiver;
  const auto hear = [&receiver](std::int64_t second, const std::vector<Message>& messages) {
    receiver.advance(second * kSecond_ns);
    feed(receiver, messages);
    return receiver.progress().at(0).quiet_since_ns / kSecond_ns;
  };
  CHECK(hear(1, pieces(kAlpha.id, 0)) == 1);
  CHECK(hear(2, ended) == 2);
  CHECK(hear(3, ended) == 2);
  CHECK(hear(4, running) == 4);
  CHECK(hear(5, ended) == 4);
  CHECK(hear(6, pieces(kAlpha.id, 1)) == 6);
  CHECK(hear(7, ended) == 6);
  // What has been here before says nothing.
  CHECK(hear(8, pieces(kAlpha.id, 1)) == 6);
}

TEST_CASE("pieces that agree with each other but not with their checksum are no keyframe") {
  // A forger's pieces: consistent heads, a sound keyframe, the checksum of another one.
  Receiver receiver;
  for (Message& piece : pieces(kAlpha.id, 0)) {
    std::get<ChunkMessage>(piece).payload_crc32 ^= 1U;
    feed(receiver, std::move(piece));
  }
  CHECK(receiver.counters().keyframes == 0);
  CHECK(receiver.counters().keyframes_damaged == 1);
  CHECK(take_session(receiver).keyframes_damaged == 1);
}

TEST_CASE("memory of sessions that were taken is there for the next ones") {
  Receiver receiver(limited(&ReceiverLimits::max_stored_bytes, 100000));
  for (int round = 0; round < 5; ++round) {
    feed(receiver, session_stream(kAlpha, 4));
    CHECK(receiver.counters().refused == 0);
    check_whole(take_session(receiver), kAlpha, 4);
  }
}

TEST_CASE("a flood of unfinished keyframes stays within its bound and gives up the oldest") {
  ReceiverLimits limits = limited(&ReceiverLimits::max_pending_keyframes, 8);
  limits.max_pending_bytes = 100000;
  Reassembly reassembly(limits);
  ChunkMessage chunk;
  chunk.count = 1000;
  chunk.total_bytes = 1000 * 400;
  chunk.data.assign(400, 0);
  for (std::uint32_t sequence = 0; sequence < 1000; ++sequence) {
    chunk.sequence = sequence % 100;
    chunk.index = sequence;
    reassembly.add(ChunkMessage(chunk), false);
    REQUIRE(reassembly.pending_keyframes() <= 8);
    REQUIRE(reassembly.pending_bytes() <= 100000);
  }
  CHECK(reassembly.given_up() > 900);
  // One keyframe alone may not exceed the bound either.
  chunk.sequence = 5000;
  for (chunk.index = 0; chunk.index < 999; ++chunk.index) {
    reassembly.add(ChunkMessage(chunk), false);
    REQUIRE(reassembly.pending_bytes() <= 100000);
  }
}

TEST_CASE("one-byte pieces count towards the memory limit") {
  Reassembly reassembly(limited(&ReceiverLimits::max_pending_bytes, 10000));
  ChunkMessage chunk;
  chunk.count = 1U << 20U;
  chunk.total_bytes = 1U << 20U;
  chunk.data.assign(1, 0);
  for (chunk.index = 0; chunk.index < 1000; ++chunk.index)
    reassembly.add(ChunkMessage(chunk), false);
  CHECK(reassembly.given_up() > 0);
}

TEST_CASE("limits refuse and count") {
  SECTION("a keyframe too large") {
    Receiver receiver(limited(&ReceiverLimits::max_keyframe_bytes, 1000));
    feed(receiver, pieces(kAlpha.id, 0));
    CHECK(receiver.counters().keyframes == 0);
    CHECK(receiver.counters().refused > 0);
  }
  SECTION("a keyframe that takes too much memory decoded, not others") {
    Receiver receiver(limited(&ReceiverLimits::max_record_bytes, 100 * sizeof(FineCell)));
    feed(receiver, pieces(keyframe_of(kAlpha.id, 0, 1000)));
    feed(receiver, pieces(keyframe_of(kBeta.id, 0, 40)));
    CHECK(receiver.counters().keyframes_damaged == 1);
    CHECK(receiver.counters().keyframes == 1);
    CHECK(receiver.progress().at(1).received == 1);
  }
  SECTION("a session too many") {
    Receiver receiver(limited(&ReceiverLimits::max_sessions, 1));
    feed(receiver, session_stream(kAlpha, 1));
    feed(receiver, session_stream(kBeta, 1));
    CHECK(receiver.counters().refused > 0);
    CHECK(receiver.take_sessions().size() == 1);
  }
  SECTION("too much to store") {
    Receiver receiver(limited(&ReceiverLimits::max_stored_bytes, 50000));
    feed(receiver, session_stream(kAlpha, 30));
    CHECK(receiver.counters().refused > 0);
    CHECK(receiver.counters().keyframes > 0);
    CHECK(receiver.counters().keyframes < 30);
  }
  SECTION("images, which count as stored") {
    const KeyframeRecord record = keyframe_of(kAlpha.id, 0, 0);
    std::uint64_t bytes = 0;
    for (const CodedImage& image : record.images) bytes += image.code.size();
    REQUIRE(bytes > 0);
    Receiver receiver(limited(&ReceiverLimits::max_stored_bytes, bytes));
    feed(receiver, pieces(record));
    CHECK(receiver.counters().keyframes == 0);
    CHECK(receiver.counters().refused == 1);
  }
}

TEST_CASE("a session keeps its first name") {
  Receiver receiver;
  SessionInfo liar = kAlpha;
  liar.name = "omega";
  feed(receiver, session_stream(kAlpha, 1));
  feed(receiver, session_message(liar, SessionState::kEnded, 100));
  CHECK(receiver.counters().contradictory == 1);
  const SessionData session = take_session(receiver);
  CHECK(session.info.name == "alpha");
  CHECK(session.keyframes_missing == 0);
}

TEST_CASE("sessions are sorted, and equal names are told apart") {
  std::vector<SessionData> sessions(4);
  sessions[0].info = {{2, 5}, "town", ""};
  sessions[1].info = {{1, 9}, "town", ""};
  sessions[2].info = {{3, 1}, "alley", ""};
  sessions[3].info = {{1, 8}, "town", ""};
  sort_and_name(sessions);
  const std::vector<std::pair<SessionId, std::string>> expected = {
      {{3, 1}, "alley"}, {{1, 8}, "town"}, {{1, 9}, "town-2"}, {{2, 5}, "town-3"}};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(sessions[i].info.id == expected[i].first);
    CHECK(sessions[i].info.name == expected[i].second);
  }
}

TEST_CASE("health is kept per session, the latest") {
  Receiver receiver;
  feed(receiver, session_stream(kAlpha, 1));
  HealthMessage health;
  health.session = kAlpha.id;
  for (std::uint64_t scans : {10U, 20U}) {
    health.scans = scans;
    feed(receiver, Message(health));
  }
  REQUIRE(receiver.progress()[0].health.has_value());
  CHECK(receiver.progress()[0].health->scans == 20);
}
