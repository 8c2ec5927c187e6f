// Tests of the paced publisher.
#include "ports/lcm/publisher.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <future>
#include <set>

#include "ports/lcm/live.hpp"
#include "ports/lcm/received_log.hpp"
#include "tests/ports/lcm/stream.hpp"
#include "tests/wire/whole_session.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace std::chrono_literals;
using lcm_test::Message;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};

/// A network that keeps what it is given, and can be held up.
struct Network {
  std::mutex mutex;
  std::condition_variable released;
  bool held = false;
  bool broken = false;
  std::vector<Message> messages;

  Send sender() {
    return [this](std::string_view channel, Bytes message) {
      std::unique_lock lock(mutex);
      // Only keyframes are held: tests wait for the session's first message.
      released.wait(lock, [&] { return !held || channel != kKeyframeChannel; });
      if (broken) return false;
      messages.push_back({std::string(channel), {message.begin(), message.end()}});
      return true;
    };
  }
  void release() {
    {
      const std::lock_guard lock(mutex);
      held = false;
    }
    released.notify_all();
  }
  SessionData received() {
    Receiver receiver;
    for (const Message& message : messages) receive(receiver, message.channel, message.data);
    return receiver.take_sessions().at(0);
  }
};

/// A network that loses datagrams in both directions, and a base behind it.
struct LossyNetwork {
  wire_test::Random random{5};
  std::uint32_t loss_percent = 30;
  int ends_lost = 0;  ///< of the announcements of the end, the first so many
  Receiver receiver;

  Link link() {
    return {[this](std::string_view channel, Bytes message) {
              const auto session = decode_session(message);
              const bool is_end =
                  channel == kSessionChannel && session && session->state == SessionState::kEnded;
              if (is_end && ends_lost-- > 0) return true;
              if (random.below(100) >= loss_percent) receive(receiver, channel, message);
              return true;
            },
            [this] {
              auto messages = receiver.take_stored();
              std::erase_if(messages,
                            [this](const auto&) { return random.below(100) < loss_percent; });
              return messages;
            }};
  }
};

EncodedKeyframe keyframe(std::uint32_t sequence) {
  return wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, sequence));
}

PublisherOptions fast() {
  PublisherOptions options;
  options.bytes_per_second = 1e9;
  return options;
}

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

TEST_CASE("the bucket's rate holds over a long stream") {
  TokenBucket::Clock::time_point now{};
  TokenBucket bucket(20e6, 64000.0, now);
  double sent = 0.0;
  while (sent < 100e6) {
    now += bucket.wait_time(60000, now);
    bucket.take(60000);
    sent += 60000;
  }
  const double seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
  CHECK(sent / seconds == Approx(20e6).epsilon(0.01));
}

TEST_CASE("published keyframes arrive, and the end is announced three times") {
  Network network;
  Publisher publisher(kAlpha, network.sender(), fast());
  for (std::uint32_t i = 0; i < 10; ++i) publisher.publish(keyframe(i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent == 10);
  CHECK(counters.keyframes_dropped == 0);
  CHECK(counters.send_failures == 0);
  CHECK(counters.messages_sent == network.messages.size());
  const SessionData session = network.received();
  CHECK(session.info.name == "alpha");
  CHECK(session.complete);
  CHECK(session.keyframes_missing == 0);
  CHECK(session.keyframes.size() == 10);
  int ends = 0;
  for (const Message& message : network.messages) {
    const auto state = decode_session(message.data);
    ends += state && state->state == SessionState::kEnded ? 1 : 0;
  }
  CHECK(ends == 3);
}

TEST_CASE("no datagram is larger than configured") {
  for (std::uint32_t limit : {kUnfragmentedDatagramBytes, 8000U, kLargestDatagramBytes}) {
    Network network;
    PublisherOptions options = fast();
    options.datagram_bytes = limit;
    Publisher publisher(kAlpha, network.sender(), options);
    publisher.publish(wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, 0, 40000)));
    publisher.finish();
    std::size_t largest = 0;
    for (const Message& message : network.messages) {
      // LCM's header: magic, sequence number, channel and a zero.
      largest = std::max(largest, 8 + message.channel.size() + 1 + message.data.size());
    }
    CHECK(largest == limit);
    CHECK(network.received().keyframes.size() == 1);
  }
}

TEST_CASE("a full queue drops its oldest keyframe and says so") {
  Network network;
  network.held = true;
  PublisherOptions options = fast();
  options.queue_capacity = 3;
  Publisher publisher(kAlpha, network.sender(), options);
  publisher.publish(keyframe(0));
  // Once the queue is empty the thread holds keyframe 0 and waits for the network.
  for (std::uint32_t i = 1; i < 10; ++i) publisher.publish(keyframe(i));
  network.release();
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent + counters.keyframes_dropped == 10);
  CHECK(counters.keyframes_dropped >= 6);
  const SessionData session = network.received();
  CHECK(session.complete);
  CHECK(session.keyframes.size() == counters.keyframes_sent);
  CHECK(session.keyframes_missing == counters.keyframes_dropped);
  // A receiver that knows what was dropped does not wait for it.
  Receiver receiver;
  for (const Message& message : network.messages) {
    receive(receiver, message.channel, message.data);
  }
  CHECK(receiver.progress().at(0).whole);
  // The newest are the ones that survive.
  CHECK(session.keyframes.back().sequence == 9);
}

TEST_CASE("a publisher that may wait waits for a slow network, is woken and drops nothing") {
  Network network;
  network.held = true;
  PublisherOptions options = fast();
  options.queue_capacity = 1;
  options.drop_when_full = false;
  Publisher publisher(kAlpha, network.sender(), options);
  std::atomic<int> published{0};
  std::future<void> all = std::async(std::launch::async, [&] {
    for (std::uint32_t i = 0; i < 20; ++i, ++published) publisher.publish(keyframe(i));
  });
  // One keyframe is with the network, one in the queue: the third has to wait.
  while (published < 2) std::this_thread::sleep_for(1ms);
  std::this_thread::sleep_for(20ms);
  CHECK(published == 2);
  network.release();
  const bool woken = all.wait_for(20s) == std::future_status::ready;
  CHECK(woken);
  CHECK(publisher.finish().keyframes_sent == 20);
  CHECK(network.received().keyframes.size() == 20);
}

TEST_CASE("finishing wakes waiting senders, and counts keyframes that came too late") {
  Network network;
  network.held = true;
  PublisherOptions options = fast();
  options.queue_capacity = 1;
  options.drop_when_full = false;
  Publisher publisher(kAlpha, network.sender(), options);
  std::atomic<int> published{0};
  std::future<void> three = std::async(std::launch::async, [&] {
    for (std::uint32_t i = 0; i < 3; ++i, ++published) publisher.publish(keyframe(i));
  });
  while (published < 2) std::this_thread::sleep_for(1ms);
  std::this_thread::sleep_for(20ms);
  std::future<PublisherCounters> finished =
      std::async(std::launch::async, [&] { return publisher.finish(); });
  // The network is still held: nothing but `finish` can have made room.
  const bool woken = three.wait_for(20s) == std::future_status::ready;
  CHECK(woken);
  network.release();
  const PublisherCounters counters = finished.get();
  CHECK(counters.keyframes_sent == 2);
  CHECK(counters.keyframes_dropped == 1);
}

TEST_CASE("the session is repeated while nothing else happens, with the health beside it") {
  Network network;
  PublisherOptions options = fast();
  options.session_period = 5ms;
  Publisher publisher(kAlpha, network.sender(), options);
  HealthMessage health;
  health.session = kAlpha.id;
  health.scans = 17;
  publisher.set_health(health);
  while (publisher.counters().messages_sent < 20) std::this_thread::sleep_for(1ms);
  publisher.finish();
  Receiver receiver;
  for (const Message& message : network.messages) receive(receiver, message.channel, message.data);
  REQUIRE(receiver.progress().at(0).health.has_value());
  CHECK(receiver.progress()[0].health->scans == 17);
  CHECK(receiver.counters().malformed == 0);
}

TEST_CASE("a network that refuses is counted, not waited for") {
  Network network;
  network.broken = true;
  Publisher publisher(kAlpha, network.sender(), fast());
  publisher.publish(keyframe(0));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent == 0);
  CHECK(counters.messages_sent == 0);
  CHECK(counters.send_failures > 0);
}

TEST_CASE("finishing a stream that is too slow gives up in time and says what was lost") {
  Network network;
  PublisherOptions options;
  options.bytes_per_second = 1000.0;
  options.burst_bytes = 1000;
  options.datagram_bytes = 512;
  options.finish_timeout = 50ms;
  Publisher publisher(kAlpha, network.sender(), options);
  for (std::uint32_t i = 0; i < 5; ++i) publisher.publish(keyframe(i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent + counters.keyframes_dropped == 5);
  CHECK(counters.keyframes_dropped >= 4);
  const SessionData session = network.received();
  CHECK(session.complete);
  CHECK(session.keyframes_missing == counters.keyframes_dropped);
}

TEST_CASE("a publisher that is destroyed unfinished announces no end") {
  Network network;
  {
    Publisher publisher(kAlpha, network.sender(), fast());
    publisher.publish(keyframe(0));
    while (publisher.counters().keyframes_sent < 1) std::this_thread::sleep_for(1ms);
  }
  CHECK_FALSE(network.received().complete);
}

TEST_CASE("a publisher refuses options that cannot work") {
  const Send nowhere = [](std::string_view, Bytes) { return true; };
  const auto refuses = [&](const std::function<void(PublisherOptions&)>& spoil) {
    PublisherOptions options;
    spoil(options);
    CHECK_THROWS_AS(Publisher(kAlpha, nowhere, options), std::invalid_argument);
  };
  refuses([](auto& o) { o.datagram_bytes = 100; });
  refuses([](auto& o) { o.datagram_bytes = 70000; });
  refuses([](auto& o) { o.bytes_per_second = 0.0; });
  refuses([](auto& o) { o.queue_capacity = 0; });
  CHECK_THROWS_AS(Publisher({{1, 1}, "a/b", ""}, nowhere, {}), std::invalid_argument);
}

TEST_CASE("over a link that loses a third of its datagrams everything arrives") {
  LossyNetwork network;
  PublisherOptions options;
  options.datagram_bytes = 600;
  options.session_period = 100ms;
  Publisher publisher(kAlpha, network.link(), options);
  for (std::uint32_t i = 0; i < 10; ++i) publisher.publish(keyframe(i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_acknowledged == 10);
  CHECK(counters.keyframes_unacknowledged == 0);
  CHECK(counters.keyframes_dropped == 0);
  CHECK(counters.pieces_resent > 0);
  wire_test::check_whole(network.receiver.take_sessions().at(0), kAlpha, 10);
}

TEST_CASE("only what is missing is sent again") {
  LossyNetwork network;
  network.loss_percent = 5;
  PublisherOptions options;
  options.datagram_bytes = 600;
  options.session_period = 100ms;
  Publisher publisher(kAlpha, network.link(), options);
  for (std::uint32_t i = 0; i < 10; ++i) publisher.publish(keyframe(i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_acknowledged == 10);
  std::uint64_t pieces = 0;
  for (std::uint32_t i = 0; i < 10; ++i) pieces += cut_into_messages(keyframe(i), 600).size();
  CHECK(counters.pieces_resent < pieces / 2);
}

TEST_CASE("the end of a session is repeated until the base confirms it") {
  LossyNetwork network;
  network.loss_percent = 0;
  network.ends_lost = 10;
  Publisher publisher(kAlpha, network.link());
  publisher.publish(keyframe(0));
  (void)publisher.finish();
  CHECK(network.receiver.progress().at(0).ended);
  CHECK(network.ends_lost < 0);
}

TEST_CASE("what no base acknowledges is not called delivered") {
  Network network;
  PublisherOptions options;
  SECTION("at the end") {}
  SECTION("when memory is full of it") { options.unacknowledged_bytes = 10000; }
  Publisher publisher(kAlpha, Link{network.sender(), [] { return std::vector<StoredMessage>(); }},
                      options);
  for (std::uint32_t i = 0; i < 5; ++i) publisher.publish(keyframe(i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_sent == 5);
  CHECK(counters.keyframes_acknowledged == 0);
  CHECK(counters.keyframes_unacknowledged == 5);
  CHECK(counters.keyframes_dropped == 0);
  CHECK(network.received().complete);
}

TEST_CASE("a listener asks for a larger receive buffer, unless told otherwise") {
  CHECK(with_receive_buffer("udpm://239.255.76.67:7667?ttl=0") ==
        "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304");
  CHECK(with_receive_buffer("udpm://239.255.76.67:7667") ==
        "udpm://239.255.76.67:7667?recv_buf_size=4194304");
  CHECK(with_receive_buffer("udpm://239.255.76.67:7667?recv_buf_size=100") ==
        "udpm://239.255.76.67:7667?recv_buf_size=100");
  CHECK(with_receive_buffer("tcpq://localhost:7700") == "tcpq://localhost:7700");
}

TEST_CASE("a link that cannot be opened says which") {
  CHECK_THROWS_WITH(open_link("nonsense://x"), Catch::Contains("nonsense://x"));
  ListenOptions options;
  options.url = "nonsense://x";
  MemoryStorage storage(0);
  CHECK_THROWS_AS(listen(options, storage), LinkError);
}

TEST_CASE("every message is counted as sent, with its bytes, or as refused by the network") {
  // The network refuses every fifth datagram.
  std::mutex mutex;
  std::uint64_t calls = 0;
  std::uint64_t taken = 0;
  std::uint64_t bytes = 0;
  std::set<std::uint32_t> spoilt;  // keyframes
  const Send send = [&](std::string_view channel, Bytes message) {
    const std::lock_guard lock(mutex);
    if (++calls % 5 == 0) {
      if (channel == kKeyframeChannel) spoilt.insert(decode_chunk(message)->sequence);
      return false;
    }
    ++taken;
    bytes += message.size();
    return true;
  };
  PublisherOptions options = fast();
  options.datagram_bytes = 4000;
  Publisher publisher(kAlpha, send, options);
  for (std::uint32_t i = 0; i < 6; ++i) publisher.publish(keyframe(i));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.messages_sent == taken);
  CHECK(counters.bytes_sent == bytes);
  CHECK(counters.send_failures == calls - taken);
  REQUIRE_FALSE(spoilt.empty());
  REQUIRE(spoilt.size() < 6);
  CHECK(counters.keyframes_sent == 6 - spoilt.size());
  CHECK(counters.keyframes_dropped == 0);
}
