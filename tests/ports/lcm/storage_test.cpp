// Tests of publishers with a spool: evicted keyframes, restarts, earlier sessions.
#include <atomic>
#include <catch2/catch.hpp>
#include <fstream>
#include <mutex>

#include "ports/lcm/earlier_sessions.hpp"
#include "ports/lcm/publisher.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/lcm/shared_link.hpp"
#include "ports/spool/spool.hpp"
#include "tests/ports/lcm/stream.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace std::chrono_literals;
using spool::Spool;

namespace {

const SessionInfo kMonday{{1, 11}, "monday", "os2-128"};
const SessionInfo kTuesday{{1, 12}, "tuesday", "os2-128"};

/// A base on a network that works or does not.
struct Base {
  std::mutex mutex;
  Receiver receiver;
  bool reached = false;
  std::uint64_t pieces = 0;  ///< of keyframes that were sent to it, arrived or not

  Link link() {
    return {[this](std::string_view channel, Bytes message) {
              const std::lock_guard lock(mutex);
              pieces += channel == kKeyframeChannel ? 1 : 0;
              if (reached) receive(receiver, channel, message);
              return true;
            },
            [this] {
              const std::lock_guard lock(mutex);
              return reached ? receiver.take_stored() : std::vector<StoredMessage>();
            }};
  }
  void reach() {
    const std::lock_guard lock(mutex);
    reached = true;
  }
  std::vector<SessionData> sessions() {
    const std::lock_guard lock(mutex);
    return receiver.take_sessions();
  }
};

EncodedKeyframe keyframe(const SessionInfo& info, std::uint32_t sequence) {
  return wire_test::encode_for_sending(wire_test::keyframe_of(info.id, sequence));
}

PublisherOptions fast() {
  PublisherOptions options;
  options.bytes_per_second = 1e9;
  options.datagram_bytes = 1300;
  options.session_period = 20ms;
  return options;
}

/// A robot that publishes so many keyframes of a session and loses its power.
void drive(const std::filesystem::path& folder, const SessionInfo& info, std::uint32_t keyframes,
           Base& base) {
  Spool spool(folder);
  Publisher publisher(info, base.link(), fast(), &spool);
  for (std::uint32_t i = 0; i < keyframes; ++i) publisher.publish(keyframe(info, i));
  REQUIRE(spool.flush(20s));
  while (publisher.counters().keyframes_sent < keyframes) std::this_thread::sleep_for(1ms);
}

}  // namespace

TEST_CASE("keyframes that no longer fit into memory are read back when a base misses them") {
  const TemporaryDirectory folder;
  Base base;
  Spool spool(folder / "spool");
  PublisherOptions options = fast();
  options.unacknowledged_bytes = 10000;  // one or two keyframes
  Publisher publisher(kMonday, base.link(), options, &spool);
  for (std::uint32_t i = 0; i < 30; ++i) publisher.publish(keyframe(kMonday, i));
  while (publisher.counters().keyframes_sent < 30) std::this_thread::sleep_for(1ms);
  CHECK(publisher.counters().keyframes_waiting == 30);
  base.reach();
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_published == 30);
  CHECK(counters.keyframes_acknowledged == 30);
  CHECK(counters.keyframes_waiting == 0);
  CHECK(counters.keyframes_lost() == 0);
  CHECK(counters.end_confirmed);
  wire_test::check_whole(base.sessions().at(0), kMonday, 30);
}

TEST_CASE("a full queue loses nothing that is in the spool") {
  const TemporaryDirectory folder;
  Base base;
  base.reach();
  Spool spool(folder / "spool");
  PublisherOptions options = fast();
  options.queue_capacity = 2;
  options.bytes_per_second = 1e6;  // slower than the keyframes come
  Publisher publisher(kMonday, base.link(), options, &spool);
  for (std::uint32_t i = 0; i < 40; ++i) publisher.publish(keyframe(kMonday, i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_dropped == 0);
  CHECK(counters.keyframes_acknowledged == 40);
  wire_test::check_whole(base.sessions().at(0), kMonday, 40);
}

TEST_CASE("without a base everything waits in the spool, and nothing is called lost") {
  const TemporaryDirectory folder;
  Base base;
  Spool spool(folder / "spool");
  Publisher publisher(kMonday, base.link(), fast(), &spool);
  for (std::uint32_t i = 0; i < 5; ++i) publisher.publish(keyframe(kMonday, i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_acknowledged == 0);
  CHECK(counters.keyframes_waiting == 5);
  CHECK(counters.keyframes_lost() == 0);
  CHECK_FALSE(counters.end_confirmed);
}

TEST_CASE("sessions of earlier starts arrive as what they were, beside the present one") {
  const TemporaryDirectory folder;
  Base base;
  drive(folder / "spool", kMonday, 12, base);
  base.reach();
  {
    Spool spool(folder / "spool");
    SharedLink link(base.link());
    Publisher publisher(kTuesday, link.share(), fast(), &spool);
    std::atomic<bool> done{false};
    EarlierSessionsSender earlier(spool, link.share(), fast(), [&] { done = true; });
    for (std::uint32_t i = 0; i < 12; ++i) publisher.publish(keyframe(kTuesday, i));
    const EarlierCounters counters = earlier.finish(20s);
    CHECK(done);
    CHECK(counters.sessions == 1);
    CHECK(counters.sessions_delivered == 1);
    CHECK(counters.keyframes == 12);
    CHECK(counters.keyframes_acknowledged == 12);
    CHECK(counters.keyframes_lost == 0);
    CHECK(publisher.finish().keyframes_acknowledged == 12);
  }
  const auto sessions = base.sessions();
  REQUIRE(sessions.size() == 2);
  wire_test::check_whole(sessions[0], kMonday, 12);
  wire_test::check_whole(sessions[1], kTuesday, 12);
  // The start after has nothing left to do.
  const Spool spool(folder / "spool");
  for (const EarlierSession& session : spool.earlier_sessions()) {
    CHECK(session.ended);
    CHECK(session.waiting.empty());
  }
}

TEST_CASE("what a base acknowledged before the restart is not sent again") {
  const TemporaryDirectory folder;
  Base base;
  base.reach();
  {
    Spool spool(folder / "spool");
    Publisher publisher(kMonday, base.link(), fast(), &spool);
    for (std::uint32_t i = 0; i < 8; ++i) publisher.publish(keyframe(kMonday, i));
    while (publisher.counters().keyframes_acknowledged < 8) std::this_thread::sleep_for(1ms);
  }
  const std::uint64_t before = base.pieces;
  Spool spool(folder / "spool");
  EarlierSessionsSender earlier(spool, base.link(), fast());
  const EarlierCounters counters = earlier.finish(20s);
  CHECK(counters.sessions_delivered == 1);
  CHECK(counters.keyframes == 0);
  CHECK(base.pieces == before);
  wire_test::check_whole(base.sessions().at(0), kMonday, 8);
}

TEST_CASE("of earlier sessions no keyframe is sent where nobody answers") {
  const TemporaryDirectory folder;
  Base base;
  drive(folder / "spool", kMonday, 5, base);
  const std::uint64_t before = base.pieces;
  {
    Spool spool(folder / "spool");
    EarlierSessionsSender earlier(spool, base.link(), fast());
    CHECK(earlier.finish(100ms).keyframes_acknowledged == 0);
  }
  CHECK(base.pieces == before);
  const Spool spool(folder / "spool");
  REQUIRE(spool.earlier_sessions().size() == 1);
  CHECK(spool.earlier_sessions()[0].waiting.size() == 5);
}

TEST_CASE("a keyframe damaged on disk is counted as lost, and the others arrive") {
  const TemporaryDirectory folder;
  Base base;
  drive(folder / "spool", kMonday, 5, base);
  base.reach();
  for (const auto& entry : std::filesystem::directory_iterator(folder / "spool")) {
    if (entry.path().extension() != ".spool") continue;
    std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(-10, std::ios::end);  // within the last keyframe
    file.put('?').put('!');
  }
  Spool spool(folder / "spool");
  EarlierSessionsSender earlier(spool, base.link(), fast());
  const EarlierCounters counters = earlier.finish(20s);
  CHECK(counters.sessions_delivered == 1);
  CHECK(counters.keyframes_acknowledged == 4);
  CHECK(counters.keyframes_lost == 1);
  const auto sessions = base.sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].keyframes.size() == 4);
  CHECK(sessions[0].keyframes_missing == 1);
}

TEST_CASE("publishers that share a link both hear the base") {
  Base base;
  base.reach();
  SharedLink link(base.link());
  Publisher monday(kMonday, link.share(), fast());
  Publisher tuesday(kTuesday, link.share(), fast());
  for (std::uint32_t i = 0; i < 5; ++i) {
    monday.publish(keyframe(kMonday, i));
    tuesday.publish(keyframe(kTuesday, i));
  }
  CHECK(monday.finish().keyframes_acknowledged == 5);
  CHECK(tuesday.finish().keyframes_acknowledged == 5);
}
