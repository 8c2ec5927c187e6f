// Tests of the relay's faults, of generated keyframes and of the time to catch up.
#include "bench/faults/faults.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <stdexcept>

#include "bench/faults/backlog.hpp"
#include "bench/faults/forgeries.hpp"
#include "bench/faults/keyframes.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::bench;

namespace {

/// Share of 20,000 datagrams of which `holds` is true.
template <typename Predicate>
double share(const std::string& faults, std::size_t bytes, Predicate holds) {
  constexpr int kDatagrams = 20000;
  FaultyDirection direction(parse_faults(faults), 7);
  int count = 0;
  for (int i = 0; i < kDatagrams; ++i) count += holds(direction.next(bytes, 1.0)) ? 1 : 0;
  return static_cast<double>(count) / kDatagrams;
}

const auto is_lost = [](const Fate& fate) { return fate.copies == 0; };

}  // namespace

TEST_CASE("each fault befalls the share of datagrams that it is given") {
  CHECK(share("drop=0.3", 1000, is_lost) == Approx(0.3).margin(0.02));
  CHECK(share("duplicate=0.5", 1000, [](const Fate& fate) { return fate.copies == 2; }) ==
        Approx(0.5).margin(0.02));
  CHECK(share("reorder=0.2", 1000, [](const Fate& fate) { return fate.reordered; }) ==
        Approx(0.2).margin(0.02));
  CHECK(share("flip=0.04", 1000, [](const Fate& fate) { return fate.flip_bit.has_value(); }) ==
        Approx(0.04).margin(0.01));
  CHECK(share("", 1000, [](const Fate& fate) {
          return fate.copies != 1 || fate.reordered || fate.flip_bit || fate.delay_ms[0] > 0.0;
        }) == 0.0);
}

TEST_CASE("a datagram is lost with any of its Ethernet fragments") {
  CHECK(fragments_of(1472) == 1);
  CHECK(fragments_of(1473) == 2);
  CHECK(fragments_of(60000) == 41);
  CHECK(share("fragments=0.05", 1300, is_lost) == Approx(0.05).margin(0.01));
  CHECK(share("fragments=0.05", 60000, is_lost) == Approx(1.0 - std::pow(0.95, 41)).margin(0.02));
}

TEST_CASE("the fate of a datagram follows from the seed and its number alone") {
  FaultyDirection one(parse_faults("drop=0.5"), 3);
  FaultyDirection same(parse_faults("drop=0.5,flip=0.5,duplicate=0.5,reorder=0.5"), 3);
  FaultyDirection other(parse_faults("drop=0.5"), 4);
  int equal = 0;
  for (int i = 0; i < 1000; ++i) {
    const bool lost = is_lost(one.next(1000, 0.0));
    REQUIRE(lost == is_lost(same.next(50000, 9.0)));
    equal += lost == is_lost(other.next(1000, 0.0)) ? 1 : 0;
  }
  CHECK(equal < 600);
}

TEST_CASE("a direction is down from the first moment of its interval to the last") {
  FaultyDirection direction(parse_faults("down=3+1.5"), 1);
  CHECK_FALSE(direction.next(100, 2.999).down);
  CHECK(direction.next(100, 3.0).down);
  CHECK(direction.next(100, 4.499).copies == 0);
  CHECK_FALSE(direction.next(100, 4.5).down);
}

TEST_CASE(
    "a bottleneck lets its rate pass, delays what waits and loses what its queue cannot hold") {
  FaultyDirection direction(parse_faults("rate=10000,queue=5500,delay=10"), 1);
  // 972 bytes and the headers of IP and UDP take a tenth of a second.
  std::vector<double> delays_ms;
  for (int i = 0; i < 8; ++i) {
    const Fate fate = direction.next(972, 1.0);
    if (fate.copies == 1) delays_ms.push_back(fate.delay_ms[0]);
  }
  REQUIRE(delays_ms.size() == 5);
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(delays_ms[i] == Approx(10.0 + 100.0 * static_cast<double>(i + 1)));
  }
  // What waited is through; a datagram larger than the queue passes an idle link all the same.
  CHECK(direction.next(9972, 2.0).delay_ms[0] == Approx(1010.0));
  CHECK(direction.next(972, 2.5).copies == 0);
  CHECK(direction.next(972, 3.0).delay_ms[0] == Approx(110.0));
}

TEST_CASE("what is no fault is refused") {
  for (const char* text : {"drop", "drop=", "drop=1.1", "drop=-0.1", "drop=nan", "dorp=0.1",
                           "down=3", "down=3+x", "delay=1ms", ",", "drop=0.1;delay=1"}) {
    INFO(text);
    CHECK_THROWS_AS(parse_faults(text), std::invalid_argument);
  }
}

TEST_CASE("generated keyframes are valid, of about the wanted size, and the same for one seed") {
  const SessionId session{5, 17};
  for (const std::uint32_t bytes : {5000U, 80000U, 500000U}) {
    KeyframeSize size;
    size.bytes = bytes;
    const wire::EncodedKeyframe keyframe = generate_keyframe(session, 3, 1, size);
    CHECK(keyframe.bytes.size() == Approx(bytes).epsilon(0.15));
    const wire::DecodedKeyframe decoded = wire::decode_keyframe(keyframe.bytes);
    REQUIRE(decoded.record);
    CHECK(decoded.record->session == session);
    CHECK(decoded.record->sequence == 3);
    CHECK(name_of(3, wire::encode_keyframe(*decoded.record)) == name_of(3, keyframe.bytes));
    CHECK(generate_keyframe(session, 3, 1, size).bytes == keyframe.bytes);
    CHECK(generate_keyframe(session, 3, 2, size).bytes != keyframe.bytes);
  }
}

TEST_CASE("keyframes of two sessions have two names") {
  const KeyframeSize size{500, 0, 1, 0.0};
  const auto name = [&](std::uint64_t session) {
    return name_of(0, generate_keyframe({5, session}, 0, 1, size).bytes);
  };
  CHECK(name(1) != name(2));
}

TEST_CASE("images take more memory at the base than on the way") {
  KeyframeSize size;
  size.bytes = 0;
  size.images = 32;
  size.image_rows = 80;
  const wire::EncodedKeyframe keyframe = generate_keyframe({5, 17}, 0, 1, size);
  const wire::DecodedKeyframe decoded = wire::decode_keyframe(keyframe.bytes);
  REQUIRE(decoded.record);
  std::size_t image_bytes = 0;
  for (const CodedImage& image : decoded.record->images) image_bytes += image.code.size();
  CHECK(decoded.record->images.size() == 32);
  CHECK(image_bytes > 10 * keyframe.bytes.size());
}

TEST_CASE("time to catch up counts from the last time that most keyframes waited") {
  Backlog backlog;
  backlog.add(0.0, 0, 0);
  CHECK(backlog.caught_up_s() == 0.0);
  backlog.add(1.0, 10, 0);
  backlog.add(2.0, 11, 1);
  CHECK(backlog.largest() == 10);
  CHECK_FALSE(backlog.caught_up_s());
  backlog.add(2.5, 12, 9);
  CHECK_FALSE(backlog.caught_up_s());
  backlog.add(3.0, 12, 10);
  backlog.add(9.0, 12, 12);
  CHECK(*backlog.caught_up_s() == Approx(1.0));
}

namespace {

/// What a forgery sends after it has overheard a message.
struct Forged {
  std::vector<std::pair<std::string, std::vector<std::uint8_t>>> messages;
  std::unique_ptr<Forgery> forgery;

  explicit Forged(const std::string& name)
      : forgery(make_forgery(name, [this](std::string_view channel, wire::Bytes message) {
          messages.emplace_back(std::string(channel),
                                std::vector<std::uint8_t>(message.begin(), message.end()));
        })) {}
};

std::vector<std::uint8_t> session_message() {
  wire::SessionMessage message;
  message.info = {{5, 17}, "victim", "vlp-16"};
  message.state = wire::SessionState::kRunning;
  message.keyframes = 3;
  return lcm_port::encode(message);
}

}  // namespace

TEST_CASE("forged messages of a session are possible ones of that session") {
  for (const char* name : {"ended", "ended-again", "renamed"}) {
    INFO(name);
    Forged forged(name);
    forged.forgery->overhear(lcm_port::kSessionChannel, session_message());
    REQUIRE(forged.messages.size() == 1);
    const auto message = lcm_port::decode_session(forged.messages[0].second);
    REQUIRE(message);
    CHECK(message->info.id == SessionId{5, 17});
    const bool differs =
        message->info.name != "victim" || message->state == wire::SessionState::kEnded;
    CHECK(differs);
    // Its own message is no reason for another.
    forged.forgery->overhear(lcm_port::kSessionChannel, forged.messages[0].second);
    CHECK(forged.messages.size() == 1);
  }
}

TEST_CASE("a forged answer says that every keyframe is stored") {
  Forged forged("acknowledgements");
  forged.forgery->overhear(lcm_port::kSessionChannel, session_message());
  forged.forgery->act(1.0, 0);
  REQUIRE(forged.messages.size() == 1);
  const auto message = lcm_port::decode_stored(forged.messages[0].second);
  REQUIRE(message);
  CHECK(message->session == SessionId{5, 17});
  CHECK(message->below > 1000000);
}

TEST_CASE("floods consist of what a base has to take seriously") {
  for (const char* name : {"pieces", "keyframes", "shifted"}) {
    INFO(name);
    Forged forged(name);
    forged.forgery->overhear(lcm_port::kSessionChannel, session_message());
    forged.forgery->act(1.0, 20000);
    REQUIRE_FALSE(forged.messages.empty());
    for (const auto& [channel, message] : forged.messages) {
      CHECK(channel == lcm_port::kKeyframeChannel);
      CHECK(lcm_port::decode_chunk(message));
    }
  }
}

TEST_CASE("a bad last piece has the head of the overheard keyframe") {
  Forged forged("bad-pieces");
  const wire::EncodedKeyframe keyframe = generate_keyframe({5, 17}, 3, 1, {});
  const auto pieces = wire::cut_into_pieces(keyframe, 1000);
  forged.forgery->overhear(lcm_port::kKeyframeChannel, lcm_port::encode(pieces.front()));
  REQUIRE(forged.messages.size() == 1);
  const auto piece = lcm_port::decode_chunk(forged.messages[0].second);
  REQUIRE(piece);
  CHECK(piece->payload_crc32 == pieces.back().payload_crc32);
  CHECK(piece->index == pieces.back().index);
  CHECK(piece->data.size() == pieces.back().data.size());
  CHECK(piece->data != pieces.back().data);
}

TEST_CASE("an unknown forgery is none") { CHECK(make_forgery("kindness", {}) == nullptr); }
