// Tests of which piece a sender sends next, and which again.
#include "tests/test.hpp"
#include "unimapper/wire/delivery.hpp"

using namespace unimapper::wire;

namespace {

constexpr std::int64_t kResendAfterNs = 400'000'000;
using Sequences = std::vector<std::uint32_t>;

/// Sends so many pieces; which keyframes they were of.
Sequences send(Outbox& outbox, int pieces, std::int64_t now_ns = 0) {
  Sequences sequences;
  for (int i = 0; i < pieces; ++i) {
    const auto piece = outbox.next();
    REQUIRE(piece);
    sequences.push_back(piece->sequence);
    outbox.sent(*piece, now_ns);
  }
  return sequences;
}

/// Nothing is stored; of the first keyframe the base lacks these pieces.
StoredMessage lacking(const std::vector<bool>& missing) {
  StoredMessage message;
  message.until = 10;
  message.incomplete = {{0, missing}};
  return message;
}

}  // namespace

TEST_CASE("keyframes go one after the other, the newest first, and every fourth is the oldest") {
  Outbox outbox(kResendAfterNs);
  for (std::uint32_t sequence = 0; sequence < 6; ++sequence) outbox.add(sequence, 2);
  CHECK(send(outbox, 12) == Sequences{5, 5, 4, 4, 3, 3, 0, 0, 2, 2, 1, 1});
}

TEST_CASE("a keyframe that was begun is finished before a newer one") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 3);
  CHECK(send(outbox, 1) == Sequences{0});
  outbox.add(1, 2);
  CHECK(outbox.may_be_next(0));
  CHECK(outbox.may_be_next(1));
  CHECK(send(outbox, 4) == Sequences{0, 0, 1, 1});
}

TEST_CASE("what a keyframe that was sent still lacks goes before others, if it is little") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 8);
  (void)send(outbox, 8);
  outbox.add(1, 3);
  (void)send(outbox, 1);
  StoredMessage message = lacking({false, false, false, true, false, true, false, false});
  SECTION("two pieces of eight") {
    (void)outbox.take(message, kResendAfterNs);
    CHECK(send(outbox, 4) == Sequences{0, 0, 1, 1});
  }
  SECTION("three of eight wait for their turn") {
    message.incomplete[0].missing[6] = true;
    (void)outbox.take(message, kResendAfterNs);
    CHECK(send(outbox, 5) == Sequences{1, 1, 0, 0, 0});
  }
}

TEST_CASE("summaries go first, the newest before all, and leave the others a quarter") {
  Outbox outbox(kResendAfterNs);
  for (std::uint32_t sequence = 0; sequence < 3; ++sequence) outbox.add(sequence, 10, 2);
  // Of the others the newest has its turn; its leading pieces are gone already.
  CHECK(send(outbox, 7) == Sequences{2, 2, 1, 2, 1, 0, 0});
  CHECK(outbox.may_be_next(2));
  // One that comes while another is being sent interrupts it for its summary only.
  outbox.add(3, 10, 2);
  CHECK(send(outbox, 5) == Sequences{2, 3, 3, 2, 2});
}

TEST_CASE("a summary that is lost is resent although its keyframe is still being sent") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 100, 3);
  (void)send(outbox, 10);
  StoredMessage message = lacking(std::vector<bool>(100, true));
  message.incomplete[0].missing[1] = false;
  std::int64_t now_ns = 0;

  SECTION("only the pieces of it that are missing, and not before they may have arrived") {
    (void)outbox.take(message, kResendAfterNs - 1);
    CHECK(outbox.next()->index == 10);
    (void)outbox.take(message, kResendAfterNs);
    for (const std::uint32_t index : {0U, 2U, 10U}) {
      CHECK(outbox.next()->index == index);
      (void)send(outbox, 1, kResendAfterNs);
    }
  }
  SECTION("not once it has arrived, whatever the base has dropped since") {
    for (std::size_t i = 0; i < 3; ++i) message.incomplete[0].missing[i] = false;
    (void)outbox.take(message, 1);
    message.incomplete.clear();
    (void)outbox.take(message, 100 * kResendAfterNs);
    CHECK(outbox.next()->index == 10);
  }
  SECTION("as often as the base says that it lacks some, and then no more without a word") {
    for (int i = 0; i < 80; ++i) {
      (void)outbox.take(message, now_ns += kResendAfterNs);
      CHECK(outbox.next()->index == 0);
      (void)send(outbox, 2, now_ns);
    }
    message.incomplete.clear();
    (void)outbox.take(message, 1000 * kResendAfterNs);
    CHECK(outbox.next()->index == 10);
  }
  SECTION("a few times if the base says nothing of it") {
    message.incomplete.clear();
    int resent = 0;
    for (int i = 0; i < 1000; ++i) {
      (void)outbox.take(message, now_ns += kResendAfterNs / 4);
      for (; outbox.next()->index < 3; ++resent) outbox.sent(*outbox.next(), now_ns);
    }
    CHECK(resent == 2 * 3);
  }
}

TEST_CASE("only what is missing is resent, and not what may be on its way still") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 4);
  while (const auto piece = outbox.next()) outbox.sent(*piece, 0);
  CHECK(outbox.was_sent(0));
  StoredMessage message = lacking({false, true, false, true});
  CHECK(outbox.take(message, kResendAfterNs - 1).empty());
  CHECK_FALSE(outbox.next());
  CHECK(outbox.take(message, kResendAfterNs).empty());
  std::vector<std::uint32_t> resent;
  while (const auto piece = outbox.next()) {
    resent.push_back(piece->index);
    outbox.sent(*piece, kResendAfterNs);
  }
  CHECK(resent == std::vector<std::uint32_t>{1, 3});

  SECTION("what the base means by other pieces is resent whole") {
    (void)outbox.take(lacking({true}), 3 * kResendAfterNs);
    int pieces = 0;
    for (; outbox.next(); ++pieces) outbox.sent(*outbox.next(), 0);
    CHECK(pieces == 4);
  }
  SECTION("a message that speaks of other numbers says nothing") {
    message.first = 1;
    (void)outbox.take(message, 3 * kResendAfterNs);
    CHECK_FALSE(outbox.next());
    CHECK(outbox.size() == 1);
  }
  SECTION("what is stored is forgotten") {
    message.below = 1;
    CHECK(outbox.take(message, 0) == Sequences{0});
    CHECK(outbox.size() == 0);
  }
}

TEST_CASE("what was sent at an earlier start is sent again only if the base misses it") {
  Outbox outbox(kResendAfterNs);
  outbox.add_sent(0, 2);
  outbox.add_sent(1, 3);
  CHECK_FALSE(outbox.next());
  CHECK(outbox.size() == 2);
  CHECK(outbox.was_sent(1));
  StoredMessage message;
  message.below = 1;
  message.first = 1;
  message.until = 10;
  message.incomplete = {{1, {false, true, false}}};
  CHECK(outbox.take(message, 0) == Sequences{0});
  const auto piece = outbox.next();
  REQUIRE(piece);
  CHECK(piece->sequence == 1);
  CHECK(piece->index == 1);
  CHECK(outbox.is_due(1));
  CHECK(outbox.may_be_next(1));
  CHECK(outbox.sent(*piece, 0));
  CHECK_FALSE(outbox.is_due(1));
}
