// Tests of probes and receipts: their bytes, the base's answers, and what a publisher learns.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <mutex>
#include <thread>
#include <unimapper_wire/probe_t.hpp>
#include <unimapper_wire/receipt_t.hpp>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/publisher.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/lcm/shared_link.hpp"
#include "tests/ports/lcm/damage.hpp"
#include "tests/wire/records.hpp"
#include "tests/wire/whole_session.hpp"
#include "unimapper/wire/receiver.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using namespace std::chrono_literals;
using lcm_test::check_only_the_original_passes;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};

ProbeMessage sample_probe() {
  ProbeMessage probe;
  probe.session = {4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}};
  probe.number = 4000000001U;
  probe.robot_time_ns = 1700000000123456789;
  probe.bytes_per_second = 32000;
  probe.clock = ClockOffset{-5000000000, 1500000, 3};
  return probe;
}

ReceiptMessage sample_receipt() {
  return {{4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}},
          0xFFFFFFFFFFFFFFFFULL,
          4000000001U,
          1700000000123456789,
          150000000,
          123456789012,
          16000000};
}

ProbeMessage probe_of(const SessionId& session, std::uint32_t number) {
  ProbeMessage probe;
  probe.session = session;
  probe.number = number;
  return probe;
}

/// A network without loss to a base that answers at once and whose clock is three hours ahead.
struct AnsweringNetwork {
  std::mutex mutex;
  Receiver receiver;
  std::uint64_t window = 1000000;
  static constexpr std::int64_t kAheadNs = 10800 * std::int64_t{1000000000};

  static std::int64_t now_ns(bool by_unix) {
    const auto steady = std::chrono::steady_clock::now().time_since_epoch();
    const auto unix_time = std::chrono::system_clock::now().time_since_epoch();
    return by_unix ? std::chrono::nanoseconds(unix_time).count()
                   : std::chrono::nanoseconds(steady).count();
  }

  Link link() {
    return {[this](std::string_view channel, Bytes message) {
              const std::lock_guard lock(mutex);
              const auto probe = channel == kProbeChannel ? decode_probe(message) : std::nullopt;
              if (probe) {
                receiver.receive(*probe, ProbeArrival{now_ns(false), now_ns(true) + kAheadNs});
              } else {
                receive(receiver, channel, message);
              }
              return true;
            },
            [this] {
              const std::lock_guard lock(mutex);
              return receiver.take_stored();
            },
            [this] {
              const std::lock_guard lock(mutex);
              std::vector<ReceivedReceipt> received;
              for (const auto& message : receiver.take_receipts(77, window, now_ns(false))) {
                received.push_back({message, std::chrono::steady_clock::now()});
              }
              return received;
            }};
  }
};

}  // namespace

TEST_CASE("probes and receipts arrive as they were sent") {
  const auto probe = decode_probe(encode(sample_probe()));
  REQUIRE(probe);
  CHECK(probe->session == sample_probe().session);
  CHECK(probe->number == 4000000001U);
  CHECK(probe->robot_time_ns == 1700000000123456789);
  CHECK(probe->bytes_per_second == 32000);
  REQUIRE(probe->clock);
  CHECK(probe->clock->base_minus_robot_ns == -5000000000);
  CHECK(probe->clock->uncertainty_ns == 1500000);
  CHECK(probe->clock->steps == 3);
  CHECK_FALSE(decode_probe(encode(probe_of(kAlpha.id, 1)))->clock);

  const auto receipt = decode_receipt(encode(sample_receipt()));
  REQUIRE(receipt);
  CHECK(receipt->session == sample_receipt().session);
  CHECK(receipt->base == 0xFFFFFFFFFFFFFFFFULL);
  CHECK(receipt->number == 4000000001U);
  CHECK(receipt->base_time_ns == 1700000000123456789);
  CHECK(receipt->held_ns == 150000000);
  CHECK(receipt->pieces == 123456789012);
  CHECK(receipt->window_bytes == 16000000);
}

TEST_CASE("damaged probes and receipts are refused, wherever the damage is") {
  check_only_the_original_passes(encode(sample_probe()), decode_probe);
  check_only_the_original_passes(encode(sample_receipt()), decode_receipt);
}

TEST_CASE("a receipt that no base sends is refused") {
  ReceiptMessage receipt = sample_receipt();
  SECTION("sent before it was asked for") { receipt.held_ns = -1; }
  SECTION("a window that holds no datagram") { receipt.window_bytes = kSmallestWindow - 1; }
  SECTION("fewer pieces than none") { receipt.pieces = 1ULL << 63U; }
  CHECK_FALSE(decode_receipt(encode(receipt)));
}

TEST_CASE("the types of probes and receipts are known") {
  CHECK(unimapper_wire::probe_t::getHash() == 0x662142ba3fbaaaa6);
  CHECK(unimapper_wire::receipt_t::getHash() == 0x2fc100bb9ddb77c8);
}

TEST_CASE("a base answers each probe once, with the pieces before it and how long it took") {
  Receiver receiver;
  const auto pieces =
      cut_into_pieces(wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, 0)), 400);
  REQUIRE(pieces.size() > 3);
  receiver.receive(ChunkMessage(pieces[0]));
  receiver.receive(ChunkMessage(pieces[0]));
  receiver.receive(probe_of(kAlpha.id, 5), ProbeArrival{1000, 2000});
  receiver.receive(ChunkMessage(pieces[1]));
  receiver.receive(probe_of(kAlpha.id, 6), ProbeArrival{1500, 2500});
  const auto receipts = receiver.take_receipts(42, 1000000, 1600);
  REQUIRE(receipts.size() == 2);
  CHECK(receipts[0].session == kAlpha.id);
  CHECK(receipts[0].base == 42);
  CHECK(receipts[0].number == 5);
  CHECK(receipts[0].pieces == 2);
  CHECK(receipts[0].held_ns == 600);
  CHECK(receipts[0].base_time_ns == 2000);
  CHECK(receipts[0].window_bytes == 1000000);
  CHECK(receipts[1].number == 6);
  CHECK(receipts[1].pieces == 3);
  CHECK(receiver.take_receipts(42, 1000000, 1700).empty());
}

TEST_CASE("the window is divided among the robots that are heard, and never too small for one") {
  Receiver receiver;
  const auto ask = [&](std::uint32_t robot, std::int64_t now_ns) {
    receiver.receive(probe_of({robot, {0, 1}}, 1), ProbeArrival{now_ns, now_ns});
  };
  for (std::uint32_t robot = 1; robot <= 4; ++robot) ask(robot, 0);
  for (const auto& receipt : receiver.take_receipts(1, 1000000, 0)) {
    CHECK(receipt.window_bytes == 250000);
  }
  ask(1, 10000000000);
  CHECK(receiver.take_receipts(1, 1000000, 10000000000).at(0).window_bytes == 1000000);
  ask(1, 10000000001);
  CHECK(receiver.take_receipts(1, 0, 10000000001).at(0).window_bytes == kSmallestWindow);
}

TEST_CASE("a flood of probes costs a bounded number of answers") {
  Receiver receiver;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    receiver.receive(probe_of(kAlpha.id, i), ProbeArrival{i, i});
  }
  const auto receipts = receiver.take_receipts(1, 1000000, 5000);
  CHECK(receipts.size() <= 16);
  CHECK(receipts.back().number == 999);
}

TEST_CASE("robot and base learn the offset of their clocks, and the rate adapts") {
  AnsweringNetwork network;
  PublisherOptions options;
  options.datagram_bytes = 1300;
  options.session_period = 10ms;
  Publisher publisher(kAlpha, network.link(), options);
  for (std::uint32_t i = 0; i < 10; ++i) {
    publisher.publish(wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, i)));
  }
  const auto base_knows = [&] {
    const std::lock_guard lock(network.mutex);
    const auto progress = network.receiver.progress();
    return !progress.empty() && progress[0].clock && progress[0].bytes_per_second > 0;
  };
  while (!base_knows() || publisher.counters().keyframes_acknowledged < 10) {
    std::this_thread::sleep_for(1ms);
  }
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.rate_adapts);
  CHECK(counters.window_bytes == 1000000);
  CHECK(counters.loss == 0.0);
  REQUIRE(counters.clock);
  const std::int64_t error =
      std::abs(counters.clock->base_minus_robot_ns - AnsweringNetwork::kAheadNs);
  CHECK(error <= counters.clock->uncertainty_ns);
  wire_test::check_whole(network.receiver.take_sessions().at(0), kAlpha, 10);
}

TEST_CASE("a base without receipts leaves a publisher at its configured rate") {
  AnsweringNetwork network;
  Link link = network.link();
  link.receipts = [] { return std::vector<ReceivedReceipt>(); };
  PublisherOptions options;
  options.bytes_per_second = 3e6;
  Publisher publisher(kAlpha, link, options);
  publisher.publish(wire_test::encode_for_sending(wire_test::keyframe_of(kAlpha.id, 0)));
  const PublisherCounters counters = publisher.finish();
  CHECK(counters.keyframes_acknowledged == 1);
  CHECK_FALSE(counters.rate_adapts);
  CHECK(counters.bytes_per_second == 3e6);
  CHECK_FALSE(counters.clock);
}

TEST_CASE("every user of a shared link gets every receipt") {
  int calls = 0;
  Link link;
  link.send = [](std::string_view, Bytes) { return true; };
  link.receive = [] { return std::vector<StoredMessage>(); };
  link.receipts = [&calls] {
    std::vector<ReceivedReceipt> receipts;
    if (calls++ == 0) receipts.push_back({sample_receipt(), {}});
    return receipts;
  };
  SharedLink shared(link);
  const Link one = shared.share();
  const Link two = shared.share();
  CHECK(one.receipts().size() == 1);
  CHECK(two.receipts().size() == 1);
  CHECK(one.receipts().empty());
}
