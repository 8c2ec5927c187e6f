// Tests of reassembly and of the receiver of sessions.
#include "unimapper/wire/receiver.hpp"

#include <catch2/catch.hpp>

#include "tests/wire/whole_session.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/reassembly.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using wire_test::check_whole;
using wire_test::feed;
using wire_test::Message;
using wire_test::Random;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};

}  // namespace

TEST_CASE("a session arrives as it was sent") {
  Receiver receiver;
  feed(receiver, wire_test::session_stream(kAlpha, 5));
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
  std::vector<Message> stream = wire_test::session_stream(kAlpha, 6);
  for (const Message& message : wire_test::session_stream(kBeta, 4)) stream.push_back(message);
  const std::size_t once = stream.size();
  for (std::size_t i = 0; i < once; ++i) stream.push_back(stream[i]);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    wire_test::shuffle(stream, random);
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
  std::vector<Message> stream = wire_test::session_stream(kAlpha, 5);
  const std::size_t pieces = wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0)).size();
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
      feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, sequence)));
    }
    const auto sessions = receiver.take_sessions();
    CHECK(sessions[0].keyframes_missing == 3);
    CHECK_FALSE(sessions[0].complete);
    CHECK(sessions[0].info.name == "robot1_boot0000000000000000000000000000000b");
  }
  SECTION("at the end, by the session's last message") {
    Receiver receiver;
    feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0)));
    feed(receiver, {wire_test::session_message(kAlpha, SessionState::kEnded, 10)});
    CHECK(receiver.take_sessions()[0].keyframes_missing == 9);
  }
  SECTION("by a first piece whose successors never come") {
    Receiver receiver;
    feed(receiver, {wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 2))[0]});
    CHECK(receiver.take_sessions()[0].keyframes_missing == 3);
  }
}

TEST_CASE("keyframes that the robot dropped are missing, but not waited for") {
  Receiver receiver;
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 1)));
  feed(receiver, {wire_test::session_message(kAlpha, SessionState::kEnded, 2, 1)});
  CHECK(receiver.progress()[0].whole);
  CHECK(receiver.take_sessions()[0].keyframes_missing == 1);
}

TEST_CASE("a late keyframe fills its gap") {
  Receiver receiver;
  std::vector<Message> late = wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0));
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 1)));
  feed(receiver, {wire_test::session_message(kAlpha, SessionState::kEnded, 2)});
  CHECK_FALSE(receiver.progress()[0].whole);
  feed(receiver, late);
  CHECK(receiver.progress()[0].whole);
  CHECK(receiver.take_sessions()[0].keyframes_missing == 0);
}

TEST_CASE("bytes that arrive whole but are no keyframe count as damaged, until a good one comes") {
  const KeyframeRecord record = wire_test::keyframe_of(kAlpha.id, 0);
  EncodedKeyframe broken = wire_test::encode_for_sending(record);
  broken.bytes[0] = 'X';
  Receiver receiver;
  feed(receiver, wire_test::pieces_of(broken));
  CHECK(receiver.counters().keyframes_damaged == 1);
  SECTION("and stays damaged") {
    const auto sessions = receiver.take_sessions();
    CHECK(sessions[0].keyframes.empty());
    CHECK(sessions[0].keyframes_damaged == 1);
    CHECK(sessions[0].keyframes_missing == 0);
  }
  SECTION("and is replaced") {
    feed(receiver, wire_test::pieces(record));
    const auto sessions = receiver.take_sessions();
    CHECK(sessions[0].keyframes.size() == 1);
    CHECK(sessions[0].keyframes_damaged == 0);
  }
}

TEST_CASE("an envelope cannot claim another robot's keyframe") {
  EncodedKeyframe stolen = wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, 0));
  stolen.session = kBeta.id;
  Receiver receiver;
  feed(receiver, wire_test::pieces_of(stolen));
  CHECK(receiver.counters().keyframes == 0);
  CHECK(receiver.counters().keyframes_damaged == 1);
}

TEST_CASE("forged pieces cannot spoil a keyframe under way") {
  const KeyframeRecord record = wire_test::keyframe_of(kAlpha.id, 0);
  const std::vector<Message> good = wire_test::pieces(record);
  EncodedKeyframe forged = wire_test::encode_for_sending(record);
  for (auto& byte : forged.bytes) byte = static_cast<std::uint8_t>(~byte);
  const std::vector<Message> bad = wire_test::pieces_of(forged);
  REQUIRE(bad.size() == good.size());
  Receiver receiver;
  for (std::size_t i = 0; i < good.size(); ++i) {
    if (i + 1 < good.size()) feed(receiver, bad[i]);
    feed(receiver, good[i]);
  }
  CHECK(receiver.counters().keyframes == 1);
}

TEST_CASE("a forged piece under an overheard head cannot spoil a keyframe, first or last") {
  const std::vector<Message> good = wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0));
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
  const std::vector<Message> good = wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0));
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
  ReceiverLimits limits;
  limits.max_pending_keyframes = 8;
  Receiver receiver(limits);
  const bool many_robots = GENERATE(false, true);
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0)));
  const std::vector<Message> victim = wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 1));
  const std::vector<Message> flood = wire_test::pieces(wire_test::keyframe_of(kBeta.id, 0));
  for (std::size_t i = 0; i < victim.size(); ++i) {
    feed(receiver, victim[i]);
    for (std::uint32_t k = 0; k < 20; ++k) {
      ChunkMessage forged = std::get<ChunkMessage>(flood[0]);
      forged.sequence = k;
      if (many_robots) forged.session.robot = 100 + k;
      feed(receiver, Message(forged));
    }
  }
  CHECK(receiver.counters().keyframes == 2);
  CHECK(receiver.counters().keyframes_abandoned > 0);
}

TEST_CASE("sessions that only announce themselves lock no robot out") {
  ReceiverLimits limits;
  limits.max_sessions = 4;
  Receiver receiver(limits);
  feed(receiver, wire_test::session_stream(kAlpha, 2));
  for (std::uint64_t i = 0; i < 200; ++i) {
    feed(receiver, {wire_test::session_message({{9, i}, "nobody", ""}, SessionState::kStarted, 0)});
  }
  feed(receiver, wire_test::session_stream(kBeta, 3));
  CHECK(receiver.progress().size() == 4);
  const auto sessions = receiver.take_sessions();
  check_whole(sessions.at(0), kAlpha, 2);
  check_whole(sessions.at(1), kBeta, 3);
  CHECK(receiver.counters().refused == 198);
}

TEST_CASE("an end that somebody else announced is taken back by the robot") {
  const std::uint64_t claimed = GENERATE(1U, 1000000U);
  Receiver receiver;
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0)));
  feed(receiver, {wire_test::session_message(kAlpha, SessionState::kRunning, 1)});
  feed(receiver, {wire_test::session_message(kAlpha, SessionState::kEnded, claimed)});
  CHECK(receiver.progress()[0].ended);
  for (int i = 0; i < 2; ++i) {
    feed(receiver, {wire_test::session_message(kAlpha, SessionState::kRunning, 2)});
  }
  CHECK_FALSE(receiver.progress()[0].ended);
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 1)));
  feed(receiver, {wire_test::session_message(kAlpha, SessionState::kEnded, 2)});
  CHECK(receiver.progress()[0].whole);
  check_whole(receiver.take_sessions().at(0), kAlpha, 2);
}

TEST_CASE("an end counts from the last sign that the session runs, however often it is said") {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  Receiver receiver;
  const auto hear = [&receiver](std::int64_t second, const std::vector<Message>& messages) {
    receiver.advance(second * kSecond_ns);
    feed(receiver, messages);
    return receiver.progress().at(0).quiet_since_ns / kSecond_ns;
  };
  const auto says = [](SessionState state) {
    return std::vector<Message>{wire_test::session_message(kAlpha, state, 2)};
  };
  const auto keyframe = [](std::uint32_t sequence) {
    return wire_test::pieces(wire_test::keyframe_of(kAlpha.id, sequence));
  };
  CHECK(hear(1, keyframe(0)) == 1);
  CHECK(hear(2, says(SessionState::kEnded)) == 2);
  CHECK(hear(3, says(SessionState::kEnded)) == 2);
  CHECK(hear(4, says(SessionState::kRunning)) == 4);
  CHECK(hear(5, says(SessionState::kEnded)) == 4);
  CHECK(hear(6, keyframe(1)) == 6);
  CHECK(hear(7, says(SessionState::kEnded)) == 6);
  // What has been here before says nothing.
  CHECK(hear(8, keyframe(1)) == 6);
}

TEST_CASE("a keyframe that takes too much memory decoded is not taken, others are") {
  ReceiverLimits limits;
  limits.max_record_bytes = 100 * sizeof(FineCell);
  Receiver receiver(limits);
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0, 1000)));
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kBeta.id, 0, 40)));
  CHECK(receiver.counters().keyframes_damaged == 1);
  CHECK(receiver.counters().keyframes == 1);
  CHECK(receiver.progress().at(1).received == 1);
}

TEST_CASE("pieces that agree with each other but not with their checksum are no keyframe") {
  // A forger's pieces: consistent heads, a sound keyframe, the checksum of another one.
  const EncodedKeyframe keyframe =
      wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, 0));
  Receiver receiver;
  for (ChunkMessage& piece : cut_into_pieces(keyframe, 433)) {
    piece.payload_crc32 ^= 1U;
    receiver.receive(std::move(piece));
  }
  CHECK(receiver.counters().keyframes == 0);
  CHECK(receiver.counters().keyframes_damaged == 1);
  CHECK(receiver.take_sessions().at(0).keyframes_damaged == 1);
}

TEST_CASE("memory of sessions that were taken is there for the next ones") {
  ReceiverLimits limits;
  limits.max_stored_bytes = 100000;
  Receiver receiver(limits);
  for (int round = 0; round < 5; ++round) {
    feed(receiver, wire_test::session_stream(kAlpha, 4));
    CHECK(receiver.counters().refused == 0);
    check_whole(receiver.take_sessions().at(0), kAlpha, 4);
  }
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
  ReceiverLimits limits;
  limits.max_pending_bytes = 10000;
  Reassembly reassembly(limits);
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
    ReceiverLimits limits;
    limits.max_keyframe_bytes = 1000;
    Receiver receiver(limits);
    feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0)));
    CHECK(receiver.counters().keyframes == 0);
    CHECK(receiver.counters().refused > 0);
  }
  SECTION("a session too many") {
    ReceiverLimits limits;
    limits.max_sessions = 1;
    Receiver receiver(limits);
    feed(receiver, wire_test::session_stream(kAlpha, 1));
    feed(receiver, wire_test::session_stream(kBeta, 1));
    CHECK(receiver.counters().refused > 0);
    CHECK(receiver.take_sessions().size() == 1);
  }
  SECTION("too much to store") {
    ReceiverLimits limits;
    limits.max_stored_bytes = 50000;
    Receiver receiver(limits);
    feed(receiver, wire_test::session_stream(kAlpha, 30));
    CHECK(receiver.counters().refused > 0);
    CHECK(receiver.counters().keyframes > 0);
    CHECK(receiver.counters().keyframes < 30);
  }
}

TEST_CASE("a session keeps its first name") {
  Receiver receiver;
  SessionInfo liar = kAlpha;
  liar.name = "omega";
  feed(receiver, wire_test::session_stream(kAlpha, 1));
  feed(receiver, {wire_test::session_message(liar, SessionState::kEnded, 100)});
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
  feed(receiver, wire_test::session_stream(kAlpha, 1));
  HealthMessage health;
  health.session = kAlpha.id;
  for (std::uint64_t scans : {10U, 20U}) {
    health.scans = scans;
    receiver.receive(HealthMessage(health));
  }
  REQUIRE(receiver.progress()[0].health.has_value());
  CHECK(receiver.progress()[0].health->scans == 20);
}

TEST_CASE("a keyframe is cut into as few pieces as can hold it, all but the last of them full") {
  constexpr std::uint32_t kPieceBytes = 100;
  for (const std::size_t bytes : {1U, 99U, 100U, 101U, 200U, 350U}) {
    EncodedKeyframe keyframe;
    keyframe.bytes.assign(bytes, 7);
    const std::vector<ChunkMessage> pieces = cut_into_pieces(keyframe, kPieceBytes);
    REQUIRE(pieces.size() == (bytes <= 100 ? 1U : bytes <= 200 ? 2U : 4U));
    std::size_t sum = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      CHECK(pieces[i].index == i);
      CHECK(pieces[i].count == pieces.size());
      CHECK(pieces[i].total_bytes == bytes);
      if (i + 1 < pieces.size()) CHECK(pieces[i].data.size() == kPieceBytes);
      CHECK_FALSE(pieces[i].data.empty());
      sum += pieces[i].data.size();
    }
    CHECK(sum == bytes);
  }
}

TEST_CASE("every piece that a keyframe is cut into is a possible one, whatever their sizes") {
  for (std::uint32_t piece_bytes = 1; piece_bytes <= 12; ++piece_bytes) {
    for (std::size_t bytes = 1; bytes <= 40; ++bytes) {
      CAPTURE(piece_bytes, bytes);
      EncodedKeyframe keyframe;
      keyframe.bytes.assign(bytes, 7);
      for (const ChunkMessage& piece : cut_into_pieces(keyframe, piece_bytes)) {
        CHECK(is_possible(piece));
      }
    }
  }
}

TEST_CASE("a session's message that is overtaken by a later one takes nothing back") {
  Receiver receiver;
  feed(receiver, wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0)));
  feed(receiver, {wire_test::session_message(kAlpha, SessionState::kEnded, 10, 2)});
  feed(receiver, {wire_test::session_message(kAlpha, SessionState::kRunning, 3, 1)});
  CHECK(receiver.progress()[0].ended);
  const auto sessions = receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].complete);
  CHECK(sessions[0].keyframes_missing == 9);
}

TEST_CASE("a keyframe that says another number than its pieces is damaged") {
  EncodedKeyframe keyframe = wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, 3));
  keyframe.sequence = 4;
  Receiver receiver;
  feed(receiver, wire_test::pieces_of(keyframe));
  CHECK(receiver.counters().keyframes == 0);
  const auto sessions = receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].keyframes.empty());
  CHECK(sessions[0].keyframes_damaged == 1);
}

TEST_CASE("images count towards the memory limit") {
  ReceiverLimits limits;
  const KeyframeRecord record = wire_test::keyframe_of(kAlpha.id, 0, 0);
  std::size_t image_bytes = 0;
  for (const CodedImage& image : record.images) image_bytes += image.code.size();
  REQUIRE(image_bytes > 0);
  CAPTURE(image_bytes);
  limits.max_stored_bytes = image_bytes;
  Receiver receiver(limits);
  feed(receiver, wire_test::pieces(record));
  CHECK(receiver.counters().keyframes == 0);
  CHECK(receiver.counters().refused == 1);
}
