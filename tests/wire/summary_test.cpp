// Tests of summaries: what they are, and how a receiver takes them.
#include "tests/test.hpp"
#include "tests/wire/golden.hpp"
#include "tests/wire/model.hpp"
#include "tests/wire/receiving.hpp"
#include "tests/wire/same_record.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/pieces.hpp"
#include "unimapper/wire/receiver.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::wire::wire_test;

TEST_CASE("a summary is the front of a keyframe, and says where the robot was and what it saw") {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    KeyframeRecord record = random_record(seed, 50);
    quantise(record);
    const std::vector<std::uint8_t> bytes = encode_keyframe(record);
    const std::size_t length = summary_bytes(bytes).value();
    CHECK(summary_bytes(Bytes(bytes).first(kSummaryHeadBytes)) == length);
    CHECK_FALSE(summary_bytes(Bytes(bytes).first(kSummaryHeadBytes - 1)));
    const DecodedKeyframe decoded = decode_summary(Bytes(bytes).first(length));
    INFO("seed " << seed << ": " << decoded.error);
    REQUIRE(decoded.record.has_value());
    KeyframeRecord expected = record;
    expected.scans = {record.scans[record.reference_scan]};
    expected.reference_scan = 0;
    expected.static_cells.clear();
    expected.dynamic_cells.clear();
    expected.images.clear();
    expected.image_shape = {};
    expected.image_full_weight_range_m = 0.0F;
    check_same(*decoded.record, expected);
    CHECK(decoded.record->is_summary);
    CHECK_THROWS_WITH(encode_keyframe(*decoded.record), Catch::Contains("has not arrived"));
    // What follows does not matter, what is missing does.
    CHECK(decode_summary(bytes).record.has_value());
    for (std::size_t shorter = 0; shorter < length; ++shorter) {
      if (decode_summary(Bytes(bytes).first(shorter)).record) FAIL("accepted " << shorter);
    }
  }
}

TEST_CASE("a summary with 128 keypoints takes less than 4 kB, in few pieces, known beforehand") {
  KeyframeRecord record = small_record();
  record.planes.clear();
  record.keypoints.resize(128, record.keypoints.front());
  const std::vector<std::uint8_t> bytes = encode_keyframe(record);
  CHECK(summary_bytes(bytes) == 3618U);
  CHECK(count_leading_pieces(bytes, 1213) == 3);
  CHECK(count_leading_pieces(bytes, 1205) == 4);
  CHECK(count_leading_pieces(bytes, 4096) == 1);
  CHECK(count_leading_pieces({}, 1213) == 3);
  // A piece of 60 kB would hold most of the keyframe besides.
  CHECK(count_leading_pieces(bytes, 59913) == 0);
  CHECK(count_leading_pieces({}, 59913) == 0);
}

TEST_CASE("a forged summary is refused with the reason") {
  const std::vector<std::uint8_t> good = encode_keyframe(small_record());
  CHECK(decode_summary(good).error.empty());
  const std::tuple<std::size_t, const char*, const char*> forgeries[] = {
      {kSchemaAt, "05", "unknown schema"},         {kReferenceScanAt, "02", "reference scan"},
      {kPoseAt, "000000000000F87F", "not finite"}, {kScanCountAt + 4, "FFFF", "fewer bytes"},
      {kUpAt, "000080B9", "covariance of up"},     {kCellEdgeAt, "0000", "cells of such a size"}};
  for (const auto& [at, digits, reason] : forgeries) {
    CHECK_THAT(decode_summary(forged(good, at, digits)).error, Catch::Contains(reason));
  }
}

TEST_CASE("of a keyframe that never becomes whole the summary is kept") {
  Receiver receiver;
  say(receiver, SessionState::kRunning, 3);
  feed(receiver, pieces(kAlpha.id, 0));
  const KeyframeRecord record = keyframe_of(kAlpha.id, 1);
  feed(receiver, all_but_last_piece(record));
  CHECK(receiver.counters().summaries >= 1);
  CHECK(receiver.counters().keyframes == 1);
  REQUIRE(receiver.progress().size() == 1);
  CHECK(receiver.progress()[0].received == 1);
  CHECK(receiver.progress()[0].summaries == 1);
  // It is no keyframe: the robot goes on sending.
  const StoredMessage said = receiver.take_stored().at(0);
  CHECK(said.below == 1);
  CHECK(said.incomplete.size() == 1);

  SECTION("it comes with the session, apart from the keyframes") {
    const SessionData session = take_session(receiver);
    CHECK(session.keyframes.size() == 1);
    REQUIRE(session.summaries.size() == 1);
    CHECK(session.summaries[0].is_summary);
    CHECK(session.summaries[0].sequence == 1);
    CHECK(session.summaries[0].keypoints.size() == record.keypoints.size());
    CHECK(session.keyframes_missing == 2);
  }
  SECTION("the keyframe replaces it") {
    feed(receiver, pieces(record).back());
    CHECK(receiver.progress()[0].received == 2);
    CHECK(receiver.progress()[0].summaries == 0);
    const SessionData session = take_session(receiver);
    CHECK(session.keyframes.size() == 2);
    CHECK(session.summaries.empty());
  }
}

TEST_CASE("a summary takes its first pieces and no others, in any order") {
  const std::vector<Message> pieces = wire_test::pieces(keyframe_of(kAlpha.id, 0));
  const std::size_t leading = count_leading_pieces(encode_keyframe(keyframe_of(kAlpha.id, 0)), 433);
  REQUIRE(leading > 1);
  REQUIRE(leading < pieces.size());
  Receiver receiver;
  for (std::size_t i = leading; i < pieces.size(); ++i) feed(receiver, pieces[i]);
  for (std::size_t i = leading; i-- > 1;) feed(receiver, pieces[i]);
  CHECK(receiver.counters().summaries == 0);
  Receiver first;
  for (std::size_t i = leading; i-- > 0;) feed(first, pieces[i]);
  CHECK(first.counters().summaries == 1);
}

TEST_CASE("of two summaries that differ neither counts, until the keyframe is whole") {
  KeyframeRecord forged = keyframe_of(kAlpha.id, 0);
  forged.T_odometry_keyframe.translation.x() += 100.0;
  Receiver receiver;
  feed(receiver, all_but_last_piece(forged));
  CHECK(receiver.progress()[0].summaries == 1);
  const KeyframeRecord record = keyframe_of(kAlpha.id, 0);
  feed(receiver, all_but_last_piece(record));
  feed(receiver, all_but_last_piece(record));
  CHECK(receiver.progress()[0].summaries == 0);
  CHECK(receiver.counters().contradictory == 1);
  feed(receiver, pieces(record).back());
  const SessionData session = take_session(receiver);
  REQUIRE(session.keyframes.size() == 1);
  CHECK(session.summaries.empty());
}

TEST_CASE("a summary that belongs to another keyframe is none") {
  Receiver receiver;
  for (Message& piece : all_but_last_piece(keyframe_of(kAlpha.id, 0))) {
    std::get<ChunkMessage>(piece).sequence = 5;
    feed(receiver, std::move(piece));
  }
  CHECK(receiver.counters().summaries == 0);
  CHECK(take_session(receiver).summaries.empty());
}
