// Tests of the control of a sender's rate, over a simulated link.
#include "ports/lcm/pacing.hpp"

#include "tests/ports/lcm/simulated_link.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::lcm_port;
using lcm_test::LinkModel;
using lcm_test::SimulatedLink;

namespace {

constexpr std::int64_t kSecond = 1000000000;

/// Mean of the rates from one time to another, in seconds.
double mean_rate(const SimulatedLink& world, std::size_t from_s, std::size_t to_s) {
  const auto begin = world.rates.begin() + static_cast<std::ptrdiff_t>(10 * from_s);
  const auto end = world.rates.begin() + static_cast<std::ptrdiff_t>(10 * to_s);
  return std::accumulate(begin, end, 0.0) / static_cast<double>(end - begin);
}

/// A robot that always has something to send, from a second after its start.
void saturate(SimulatedLink& world, std::int64_t seconds) {
  world.run(kSecond);
  world.publish(1000000);
  world.run(seconds * kSecond);
}

/// Receipts by hand.
wire::ReceiptMessage receipt(std::uint32_t number, std::uint64_t pieces) {
  return {{}, 1, number, 0, 0, pieces, 1000000};
}

}  // namespace

TEST_CASE("the rate converges to the bottleneck, and little is lost") {
  const double bottleneck = GENERATE(32000.0, 250000.0);  // 256 kbit/s and 2 Mbit/s
  const double queue = bottleneck * 0.25;
  SimulatedLink world({bottleneck, queue, 0, 10000000}, {}, true);
  saturate(world, 10);
  const std::uint64_t sent = world.sent;
  const std::uint64_t arrived = world.arrived;
  world.run(40 * kSecond);
  CHECK(mean_rate(world, 10, 40) > 0.8 * bottleneck);
  CHECK(mean_rate(world, 10, 40) < 1.1 * bottleneck);
  const auto got = static_cast<double>(world.arrived - arrived);
  CHECK(got * SimulatedLink::kPieceBytes / 30.0 > 0.85 * bottleneck);
  CHECK(got > 0.93 * static_cast<double>(world.sent - sent));
}

TEST_CASE("what one sends and resends falls to a fraction of what a fixed rate takes") {
  const double bottleneck = GENERATE(32000.0, 250000.0);
  const LinkModel link{bottleneck, bottleneck * 0.25, 0, 10000000};
  const auto pieces = static_cast<std::uint32_t>(bottleneck / 1300.0);  // of a second
  const auto deliver = [&](bool adapts) {
    SimulatedLink world(link, {}, adapts);
    world.run(kSecond);
    for (int i = 0; i < 20; ++i) world.publish(pieces);
    while (!world.is_idle() && world.now_ns() < 200 * kSecond) world.run(world.now_ns() + kSecond);
    CHECK(world.is_idle());
    return world.resent;
  };
  CAPTURE(bottleneck);
  CHECK(deliver(true) * 5 < deliver(false));
}

TEST_CASE("random loss does not slow a robot down for good") {
  const std::uint32_t loss = GENERATE(50U, 300U);
  SimulatedLink world({4e6, 400000.0, loss, 5000000}, {4000.0, 2e6, 250e3}, true);
  saturate(world, 40);
  CHECK(mean_rate(world, 30, 40) > 1e6);
}

TEST_CASE("a robot that makes a little more than its link carries loses little of it") {
  const double bottleneck = GENERATE(32000.0, 250000.0);
  SimulatedLink world({bottleneck, 0.25 * bottleneck, 0, 10000000}, {}, true);
  const auto pieces =
      static_cast<std::uint32_t>(1.2 * bottleneck / SimulatedLink::kPieceBytes / 10);
  const auto drive = [&](std::int64_t until) {
    while (world.now_ns() < until) {
      world.run(world.now_ns() + kSecond / 10);
      world.publish(pieces);
    }
  };
  drive(10 * kSecond);
  const std::uint64_t sent = world.sent;
  const std::uint64_t arrived = world.arrived;
  drive(40 * kSecond);
  CHECK(static_cast<double>(world.arrived - arrived) >
        0.9 * static_cast<double>(world.sent - sent));
}

TEST_CASE("random loss on a fast link does not keep a robot from sending what it makes") {
  const auto seed = GENERATE(as<std::uint64_t>(), 1, 2, 3, 4, 5, 6);
  const auto loss_per_mille = GENERATE(as<std::uint32_t>(), 20, 50, 80, 150);
  SimulatedLink world({20e6, 1e6, loss_per_mille, 1000000}, {}, true, seed);
  // Ten keyframes of 80 kB a second.
  for (std::int64_t at = 0; at < 20 * kSecond; at += kSecond / 10) {
    world.run(at);
    world.publish(62);
  }
  world.run(26 * kSecond);
  CAPTURE(seed, loss_per_mille, world.pacing.rate());
  CHECK(world.is_idle());
}

TEST_CASE("the rate follows a bottleneck that narrows and widens again") {
  SimulatedLink world({250000.0, 60000.0, 0, 10000000}, {}, true);
  saturate(world, 20);
  world.link_ = {32000.0, 16000.0};
  world.run(40 * kSecond);
  CHECK(mean_rate(world, 30, 40) < 40000.0);
  world.link_ = {250000.0, 60000.0};
  world.run(70 * kSecond);
  CHECK(mean_rate(world, 60, 70) > 180000.0);
}

TEST_CASE("a base that falls silent is sent less, and soon as much as before when it is back") {
  SimulatedLink world({250000.0, 60000.0, 0, 10000000}, {}, true);
  saturate(world, 15);
  const double before = mean_rate(world, 10, 15);
  world.base_is_there = false;
  world.run(35 * kSecond);
  CHECK(world.pacing.is_silent());
  CHECK(world.pacing.rate() < 0.6 * before);
  CHECK(world.pacing.rate() > 0.3 * before);
  world.base_is_there = true;
  world.run(45 * kSecond);
  CHECK_FALSE(world.pacing.is_silent());
  CHECK(mean_rate(world, 40, 45) > 0.7 * before);
}

TEST_CASE("after an outage a robot that met no bound of the link delivers what waits at once") {
  constexpr std::int64_t kStep = kSecond / 5;
  constexpr double kPiece = 60000.0;
  Pacing pacing({240e3, 20e6, 960e3});
  std::uint64_t arrived = 0;
  std::int64_t now = 0;
  // Sends what it makes, or what waits as fast as it may; the answer comes a millisecond later.
  const auto run = [&](std::int64_t until, bool has_backlog, bool base_is_there) {
    for (; now < until; now += kStep) {
      const double most = has_backlog ? 0.2 * pacing.rate() / kPiece : 3.0;
      for (double sent = 0.0; sent < most; sent += 1.0) {
        pacing.sent(kPiece);
        arrived += base_is_there ? 1 : 0;
      }
      const std::uint32_t number = pacing.probe(now);
      if (base_is_there) pacing.take(receipt(number, arrived), now + 1000000);
      pacing.advance(now + 2000000);
    }
  };
  run(3 * kSecond, false, true);
  REQUIRE(pacing.adapts());
  run(48 * kSecond, true, false);
  CHECK(pacing.is_silent());
  CHECK(pacing.rate() >= 480e3);
  run(53 * kSecond, true, true);
  CHECK(pacing.rate() == 20e6);
}

TEST_CASE("without receipts the rate is the configured one") {
  SimulatedLink world({1e9, 1e9, 0, 1000000}, {4000.0, 300000.0, 250e3}, true);
  world.base_is_there = false;
  saturate(world, 3);
  CHECK(world.pacing.rate() == 300000.0);
  CHECK_FALSE(world.pacing.adapts());
  CHECK_FALSE(world.pacing.is_silent());
}

TEST_CASE("the rate stays within its bounds, whatever receipts say") {
  wire::wire_test::Random random(11);
  Pacing pacing({5000.0, 50000.0, 20000.0});
  std::int64_t now = 0;
  for (int i = 0; i < 20000; ++i) {
    now += random.below(300) * 1000000;
    for (std::uint32_t k = random.below(60); k > 0; --k) pacing.sent(random.below(60000));
    const std::uint32_t number = pacing.probe(now);
    wire::ReceiptMessage message = receipt(number - random.below(3), random.below(100000));
    message.base = random.below(3);
    message.held_ns = random.below(1000) * 10000000LL;
    message.window_bytes = random.below(200000);
    pacing.take(message, now);
    pacing.advance(now);
    REQUIRE(pacing.rate() >= 5000.0);
    REQUIRE(pacing.rate() <= 50000.0);
    REQUIRE(pacing.loss() >= 0.0);
    REQUIRE(pacing.loss() <= 1.0);
    REQUIRE(pacing.round_trip_ns() >= 0);
    REQUIRE(pacing.bytes_on_the_way() >= 0.0);
    REQUIRE((!pacing.window_bytes() || *pacing.window_bytes() >= wire::kSmallestWindow));
  }
}

TEST_CASE("equal events give equal rates") {
  const auto rates = [] {
    SimulatedLink world({100000.0, 20000.0, 30, 20000000}, {}, true, 7);
    saturate(world, 15);
    return world.rates;
  };
  CHECK(rates() == rates());
}

TEST_CASE("receipts that are late, repeated, invented or another base's say nothing") {
  Pacing pacing({1000.0, 1e6, 1000.0});
  const std::uint32_t first = pacing.probe(0);
  const std::uint32_t second = pacing.probe(1);
  CHECK_FALSE(pacing.take(receipt(second + 1, 0), 10));
  CHECK(pacing.take(receipt(second, 0), 10));
  CHECK_FALSE(pacing.take(receipt(second, 0), 11));
  CHECK_FALSE(pacing.take(receipt(first, 0), 12));
  wire::ReceiptMessage other = receipt(pacing.probe(20), 0);
  other.base = 2;
  CHECK_FALSE(pacing.take(other, 30));
  // Unless the first one is silent.
  other.number = pacing.probe(3 * kSecond);
  CHECK(pacing.take(other, 3 * kSecond + 1));
}

TEST_CASE("the round trip leaves out what the base took") {
  Pacing pacing({1000.0, 1e6, 1000.0});
  wire::ReceiptMessage message = receipt(pacing.probe(1000), 0);
  message.held_ns = 150000000;
  REQUIRE(pacing.take(message, 1000 + 180000000));
  CHECK(pacing.round_trip_ns() == 30000000);
  CHECK(pacing.resend_after_ns() == 460000000);
}

TEST_CASE("a base that starts again and counts from 0 is no loss") {
  Pacing pacing({1000.0, 1e6, 1e6});
  REQUIRE(pacing.take(receipt(pacing.probe(0), 50), 1));
  REQUIRE(pacing.take(receipt(pacing.probe(kSecond), 50), kSecond + 1));
  for (int i = 0; i < 100; ++i) pacing.sent(1300.0);
  REQUIRE(pacing.take(receipt(pacing.probe(2 * kSecond), 3), 2 * kSecond + 1));
  CHECK(pacing.loss() == 0.0);
  CHECK(pacing.rate() == 1e6);
}

TEST_CASE("bounds that cannot be are refused") {
  CHECK_THROWS_AS(Pacing({0.0, 10.0, 5.0}), std::invalid_argument);
  CHECK_THROWS_AS(Pacing({20.0, 10.0, 5.0}), std::invalid_argument);
}
