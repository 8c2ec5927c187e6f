// Tests of publishers with a spool: evicted keyframes, restarts, earlier sessions.
#include "ports/lcm/earlier_sessions.hpp"
#include "ports/spool/spool.hpp"
#include "tests/ports/lcm/network.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace unimapper::lcm_port::lcm_test;
using namespace std::chrono_literals;
using spool::Spool;

namespace {

PublisherOptions fast() {
  PublisherOptions options;
  options.bytes_per_second = 1e9;
  options.datagram_bytes = 1300;
  options.session_period = 20ms;
  return options;
}

/// A robot that publishes so many keyframes of `kMonday` and loses its power once they are on its
/// disk and sent, or, where the base is reached, acknowledged.
void drive(const std::filesystem::path& folder, std::uint32_t keyframes, Network& network) {
  Spool spool(folder);
  Publisher publisher(kMonday, network.link(), fast(), &spool);
  publish(publisher, kMonday, keyframes);
  REQUIRE(spool.flush(20s));
  const auto done = [&] {
    const PublisherCounters counters = publisher.counters();
    return network.reached ? counters.keyframes_acknowledged : counters.keyframes_sent;
  };
  while (done() < keyframes) std::this_thread::sleep_for(1ms);
}

}  // namespace

TEST_CASE("keyframes that no longer fit into memory are read back when a base misses them") {
  const TemporaryDirectory folder;
  Network network({.reached = false});
  Spool spool(folder / "spool");
  PublisherOptions options = fast();
  options.unacknowledged_bytes = 10000;  // one or two keyframes
  Publisher publisher(kMonday, network.link(), options, &spool);
  publish(publisher, kMonday, 30);
  while (publisher.counters().keyframes_sent < 30) std::this_thread::sleep_for(1ms);
  CHECK(publisher.counters().keyframes_waiting == 30);
  network.reach();
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_published == 30);
  CHECK(counters.keyframes_acknowledged == 30);
  CHECK(counters.keyframes_waiting == 0);
  CHECK(counters.keyframes_lost() == 0);
  CHECK(counters.end_confirmed);
  wire_test::check_whole(network.sessions().at(0), kMonday, 30);
}

TEST_CASE("a full queue loses nothing that is in the spool") {
  const TemporaryDirectory folder;
  Network network;
  Spool spool(folder / "spool");
  PublisherOptions options = fast();
  options.queue_capacity = 2;
  options.bytes_per_second = 1e6;  // slower than the keyframes come
  Publisher publisher(kMonday, network.link(), options, &spool);
  publish(publisher, kMonday, 40);
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_dropped == 0);
  CHECK(counters.keyframes_acknowledged == 40);
  wire_test::check_whole(network.sessions().at(0), kMonday, 40);
}

TEST_CASE("without a base everything waits in the spool, and nothing is called lost") {
  const TemporaryDirectory folder;
  Network network({.reached = false});
  Spool spool(folder / "spool");
  Publisher publisher(kMonday, network.link(), fast(), &spool);
  publish(publisher, kMonday, 5);
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_acknowledged == 0);
  CHECK(counters.keyframes_waiting == 5);
  CHECK(counters.keyframes_lost() == 0);
  CHECK_FALSE(counters.end_confirmed);
}

TEST_CASE("what a base acknowledged before the restart is not sent again") {
  const TemporaryDirectory folder;
  Network network;
  drive(folder / "spool", 8, network);
  const std::uint64_t before = network.pieces;
  Spool spool(folder / "spool");
  EarlierSessionsSender earlier(spool, network.link(), fast());
  const EarlierCounters counters = earlier.finish(20s);
  CHECK(counters.sessions_delivered == 1);
  CHECK(counters.keyframes == 0);
  CHECK(network.pieces == before);
  wire_test::check_whole(network.sessions().at(0), kMonday, 8);
}

TEST_CASE("of earlier sessions no keyframe is sent where nobody answers") {
  const TemporaryDirectory folder;
  Network network({.reached = false});
  drive(folder / "spool", 5, network);
  const std::uint64_t before = network.pieces;
  {
    Spool spool(folder / "spool");
    EarlierSessionsSender earlier(spool, network.link(), fast());
    CHECK(earlier.finish(100ms).keyframes_acknowledged == 0);
  }
  CHECK(network.pieces == before);
  const Spool spool(folder / "spool");
  REQUIRE(spool.earlier_sessions().size() == 1);
  CHECK(spool.earlier_sessions()[0].waiting.size() == 5);
}

TEST_CASE("a keyframe damaged on disk is counted as lost, and the others arrive") {
  const TemporaryDirectory folder;
  Network network({.reached = false});
  drive(folder / "spool", 5, network);
  network.reach();
  for (const auto& entry : std::filesystem::directory_iterator(folder / "spool")) {
    if (entry.path().extension() != ".spool") continue;
    std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(-10, std::ios::end);  // within the last keyframe
    file.put('?').put('!');
  }
  Spool spool(folder / "spool");
  std::atomic<bool> done{false};
  EarlierSessionsSender earlier(spool, network.link(), fast(), [&] { done = true; });
  const EarlierCounters counters = earlier.finish(20s);
  CHECK(done);
  CHECK(counters.sessions == 1);
  CHECK(counters.sessions_delivered == 1);
  CHECK(counters.keyframes_acknowledged == 4);
  CHECK(counters.keyframes_lost == 1);
  const auto sessions = network.sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].keyframes.size() == 4);
  CHECK(sessions[0].keyframes_missing == 1);
}
