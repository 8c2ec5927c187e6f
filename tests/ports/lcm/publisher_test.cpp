// Tests of the paced publisher.
#include "ports/lcm/publisher.hpp"

#include <future>

#include "ports/lcm/live.hpp"
#include "tests/ports/lcm/network.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace unimapper::lcm_port::lcm_test;
using namespace std::chrono_literals;

namespace {

PublisherOptions fast() {
  PublisherOptions options;
  options.bytes_per_second = 1e9;
  return options;
}

/// A publisher that may wait, on a network that is held: it takes two keyframes at once, one of
/// which is with the network and one in the queue. The third has to wait.
struct WaitingPublisher {
  static PublisherOptions options() {
    PublisherOptions options = fast();
    options.queue_capacity = 1;
    options.drop_when_full = false;
    return options;
  }

  Network network{{.held = true}};
  Publisher publisher{kMonday, network.link().send, options()};
  std::atomic<int> published{0};
  std::future<void> all;

  explicit WaitingPublisher(std::uint32_t keyframes) {
    all = std::async(std::launch::async, [this, keyframes] {
      for (std::uint32_t i = 0; i < keyframes; ++i, ++published) {
        publisher.publish(keyframe(kMonday, i));
      }
    });
    while (published < 2) std::this_thread::sleep_for(1ms);
    std::this_thread::sleep_for(20ms);
    CHECK(published == 2);
  }
  bool is_woken() { return all.wait_for(20s) == std::future_status::ready; }
};

}  // namespace

TEST_CASE("the bucket lets a burst through and then keeps the average rate") {
  const TokenBucket::Clock::time_point start{};
  TokenBucket bucket(1000.0, 500.0, start);
  CHECK(bucket.wait_time(400, start) == 0ns);
  bucket.take(400);
  CHECK(bucket.wait_time(100, start) == 0ns);
  bucket.take(100);
  const auto wait = bucket.wait_time(200, start);
  CHECK(wait >= 200ms);
  CHECK(wait < 201ms);
  CHECK(bucket.wait_time(200, start + wait) == 0ns);
  // Idle time does not add up beyond one burst.
  CHECK(bucket.wait_time(500, start + 1h) == 0ns);
  bucket.take(500);
  CHECK(bucket.wait_time(1, start + 1h) > 0ns);
  // More than a burst may go when the bucket is full, and is made up for afterwards.
  CHECK(bucket.wait_time(2000, start + 2h) == 0ns);
  bucket.take(2000);
  CHECK(bucket.wait_time(1, start + 2h) > 1500ms);
}

TEST_CASE("published keyframes arrive, and the end is announced three times") {
  Network network;
  Publisher publisher(kMonday, network.link().send, fast());
  publish(publisher, kMonday, 10);
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent == 10);
  CHECK(counters.keyframes_dropped == 0);
  CHECK(counters.send_failures == 0);
  CHECK(counters.messages_sent == network.datagrams);
  wire_test::check_whole(network.sessions().at(0), kMonday, 10);
  CHECK(network.ends == 3);
}

TEST_CASE("no datagram is larger than configured") {
  for (std::uint32_t limit : {kUnfragmentedDatagramBytes, 8000U, kLargestDatagramBytes}) {
    Network network;
    PublisherOptions options = fast();
    options.datagram_bytes = limit;
    Publisher publisher(kMonday, network.link().send, options);
    publisher.publish(keyframe(kMonday, 0, 40000));
    publisher.finish();
    CHECK(network.largest == limit);
    CHECK(network.sessions().at(0).keyframes.size() == 1);
  }
}

TEST_CASE("a full queue drops its oldest keyframe and says so") {
  Network network({.held = true});
  PublisherOptions options = fast();
  options.queue_capacity = 3;
  Publisher publisher(kMonday, network.link().send, options);
  publish(publisher, kMonday, 10);
  network.release();
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent + counters.keyframes_dropped == 10);
  CHECK(counters.keyframes_dropped >= 6);
  // A receiver that knows what was dropped does not wait for it.
  CHECK(network.receiver.progress().at(0).whole);
  const SessionData session = network.sessions().at(0);
  CHECK(session.complete);
  CHECK(session.keyframes.size() == counters.keyframes_sent);
  CHECK(session.keyframes_missing == counters.keyframes_dropped);
  // The newest are the ones that survive.
  CHECK(session.keyframes.back().sequence == 9);
}

TEST_CASE("a publisher that may wait waits for a slow network, is woken and drops nothing") {
  WaitingPublisher waiting(20);
  waiting.network.release();
  CHECK(waiting.is_woken());
  CHECK(waiting.publisher.finish().keyframes_sent == 20);
  CHECK(waiting.network.sessions().at(0).keyframes.size() == 20);
}

TEST_CASE("finishing wakes waiting senders, and counts keyframes that came too late") {
  WaitingPublisher waiting(3);
  std::future<PublisherCounters> finished =
      std::async(std::launch::async, [&] { return waiting.publisher.finish(); });
  // The network is still held: nothing but `finish` can have made room.
  CHECK(waiting.is_woken());
  waiting.network.release();
  const PublisherCounters counters = finished.get();
  CHECK(counters.keyframes_sent == 2);
  CHECK(counters.keyframes_dropped == 1);
}

TEST_CASE("the session is repeated while nothing else happens, with the health beside it") {
  Network network;
  PublisherOptions options = fast();
  options.session_period = 5ms;
  Publisher publisher(kMonday, network.link().send, options);
  HealthMessage health;
  health.session = kMonday.id;
  health.scans = 17;
  publisher.set_health(health);
  while (publisher.counters().messages_sent < 20) std::this_thread::sleep_for(1ms);
  publisher.finish();
  REQUIRE(network.receiver.progress().at(0).health.has_value());
  CHECK(network.receiver.progress()[0].health->scans == 17);
  CHECK(network.receiver.counters().malformed == 0);
}

TEST_CASE("finishing a stream that is too slow gives up in time and says what was lost") {
  Network network;
  PublisherOptions options;
  options.bytes_per_second = 1000.0;
  options.burst_bytes = 1000;
  options.datagram_bytes = 512;
  options.finish_timeout = 50ms;
  Publisher publisher(kMonday, network.link().send, options);
  publish(publisher, kMonday, 5);
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent + counters.keyframes_dropped == 5);
  CHECK(counters.keyframes_dropped >= 4);
  const SessionData session = network.sessions().at(0);
  CHECK(session.complete);
  CHECK(session.keyframes_missing == counters.keyframes_dropped);
}

TEST_CASE("a publisher that is destroyed unfinished announces no end") {
  Network network;
  {
    Publisher publisher(kMonday, network.link().send, fast());
    publisher.publish(keyframe(kMonday, 0));
    while (publisher.counters().keyframes_sent < 1) std::this_thread::sleep_for(1ms);
  }
  CHECK_FALSE(network.sessions().at(0).complete);
}

TEST_CASE("a publisher refuses options that cannot work") {
  const Send nowhere = [](std::string_view, Bytes) { return true; };
  const auto refuses = [&](const std::function<void(PublisherOptions&)>& spoil) {
    PublisherOptions options;
    spoil(options);
    CHECK_THROWS_AS(Publisher(kMonday, nowhere, options), std::invalid_argument);
  };
  refuses([](auto& o) { o.datagram_bytes = 100; });
  refuses([](auto& o) { o.datagram_bytes = 70000; });
  refuses([](auto& o) { o.bytes_per_second = 0.0; });
  refuses([](auto& o) { o.queue_capacity = 0; });
  CHECK_THROWS_AS(Publisher({{1, 1}, "a/b", ""}, nowhere, {}), std::invalid_argument);
}

TEST_CASE("over a link that loses datagrams everything arrives, and only what is missing again") {
  const std::uint32_t loss_percent = GENERATE(5U, 30U);
  Network network({.loss_percent = loss_percent});
  PublisherOptions options;
  options.datagram_bytes = 600;
  options.session_period = 100ms;
  Publisher publisher(kMonday, network.link(), options);
  publish(publisher, kMonday, 10);
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_acknowledged == 10);
  CHECK(counters.keyframes_unacknowledged == 0);
  CHECK(counters.keyframes_dropped == 0);
  wire_test::check_whole(network.sessions().at(0), kMonday, 10);
  // Without receipts the rate is the configured one.
  CHECK_FALSE(counters.rate_adapts);
  CHECK(counters.bytes_per_second == options.bytes_per_second);
  if (loss_percent == 30) CHECK(counters.pieces_resent > 0);
  std::uint64_t pieces = 0;
  for (std::uint32_t i = 0; i < 10; ++i) {
    pieces += cut_into_messages(keyframe(kMonday, i), 600).size();
  }
  if (loss_percent == 5) CHECK(counters.pieces_resent < pieces / 2);
}

TEST_CASE("the end of a session is repeated until the base confirms it") {
  Network network({.ends_lost = 10});
  Publisher publisher(kMonday, network.link());
  publisher.publish(keyframe(kMonday, 0));
  (void)publisher.finish();
  CHECK(network.receiver.progress().at(0).ended);
  CHECK(network.ends > 10);
}

TEST_CASE("what no base acknowledges is not called delivered") {
  Network network;
  Link link = network.link();
  link.receive = [] { return std::vector<StoredMessage>(); };
  PublisherOptions options;
  SECTION("at the end") {}
  SECTION("when memory is full of it") { options.unacknowledged_bytes = 10000; }
  Publisher publisher(kMonday, link, options);
  publish(publisher, kMonday, 5);
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent == 5);
  CHECK(counters.keyframes_acknowledged == 0);
  CHECK(counters.keyframes_unacknowledged == 5);
  CHECK(counters.keyframes_dropped == 0);
  CHECK(network.sessions().at(0).complete);
}

TEST_CASE("a base that comes late gets what still is in memory, and knows how much it misses") {
  Network network({.reached = false});
  PublisherOptions options = fast();
  options.session_period = 20ms;
  options.unacknowledged_bytes = 10000;  // one or two keyframes
  Publisher publisher(kMonday, network.link(), options);
  publish(publisher, kMonday, 20);
  while (publisher.counters().keyframes_sent < 20) std::this_thread::sleep_for(1ms);
  network.reach();
  const PublisherCounters counters = publisher.finish();
  const SessionData session = network.sessions().at(0);
  CHECK(session.complete);
  CHECK(counters.keyframes_acknowledged > 0);
  CHECK(counters.keyframes_unacknowledged > 0);
  CHECK(session.keyframes.size() == counters.keyframes_acknowledged);
  CHECK(session.keyframes_missing == counters.keyframes_unacknowledged);
  CHECK(session.keyframes.size() + session.keyframes_missing == 20);
}

TEST_CASE("a listener asks for a larger receive buffer, unless told otherwise") {
  const std::string url = "udpm://239.255.76.67:7667";
  CHECK(with_receive_buffer(url + "?ttl=0") == url + "?ttl=0&recv_buf_size=4194304");
  CHECK(with_receive_buffer(url) == url + "?recv_buf_size=4194304");
  CHECK(with_receive_buffer(url + "?recv_buf_size=100") == url + "?recv_buf_size=100");
  CHECK(with_receive_buffer("file:///tmp/log") == "file:///tmp/log");
}

TEST_CASE("a link that cannot be opened says which") {
  CHECK_THROWS_WITH(open_link("nonsense://x"), Catch::Contains("nonsense://x"));
  ListenOptions options;
  options.url = "nonsense://x";
  MemoryStorage storage(0);
  CHECK_THROWS_AS(listen(options, storage), LinkError);
}

TEST_CASE("every message is counted as sent, with its bytes, or as refused by the network") {
  const std::uint64_t refused = GENERATE(1U, 5U);  // every one, or every fifth
  std::uint64_t calls = 0;
  std::uint64_t taken = 0;
  std::uint64_t bytes = 0;
  std::set<std::uint32_t> spoilt;  // keyframes
  const Send send = [&](std::string_view channel, Bytes message) {
    if (++calls % refused == 0) {
      if (channel == kKeyframeChannel) spoilt.insert(decode_chunk(message)->sequence);
      return false;
    }
    ++taken;
    bytes += message.size();
    return true;
  };
  PublisherOptions options = fast();
  options.datagram_bytes = 4000;
  Publisher publisher(kMonday, send, options);
  publish(publisher, kMonday, 6);
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.messages_sent == taken);
  CHECK(counters.bytes_sent == bytes);
  CHECK(counters.send_failures == calls - taken);
  REQUIRE_FALSE(spoilt.empty());
  CHECK((spoilt.size() < 6 || refused == 1));
  CHECK(counters.keyframes_sent == 6 - spoilt.size());
  CHECK(counters.keyframes_dropped == 0);
}
