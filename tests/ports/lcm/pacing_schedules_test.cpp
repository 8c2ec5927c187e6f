// Model of robot, link and base with probes, receipts, window and pacing, over seeded schedules.
#include "tests/ports/lcm/simulated_link.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::lcm_port;
using lcm_test::LinkModel;
using lcm_test::SimulatedLink;
using wire::wire_test::Random;

namespace {

constexpr std::int64_t kSecond = 1000000000;
constexpr double kMinimum = 5200.0;
constexpr double kMaximum = 20e6;

/// From 64 kbit/s to 16 Mbit/s, queues of 0.2 to 1 s, up to 200 ms one way.
LinkModel random_link(Random& random) {
  LinkModel link;
  link.bytes_per_second = 8000.0 * std::exp2(random.uniform(0.0, 8.0));
  link.queue_bytes = std::max(4000.0, link.bytes_per_second * random.uniform(0.2, 1.0));
  link.delay_ns = (1 + random.below(200)) * SimulatedLink::kStepNs;
  return link;
}

/// Any answer that somebody may make up.
wire::ReceiptMessage forged_receipt(Random& random) {
  const std::uint64_t base = random.below(2) == 0 ? 1 : random.bits();
  const std::uint32_t number = random.below(400);
  const std::uint64_t pieces = random.below(3) == 0 ? random.bits() : random.below(100000);
  const std::uint64_t window = random.below(3) == 0 ? random.bits() : 65536;
  const auto held_ns = random.below(2) == 0 ? 0 : static_cast<std::int64_t>(random.bits() >> 1U);
  return {{}, base, number, 0, held_ns, pieces, window};
}

/// Something befalls the link or the base.
void disturb(SimulatedLink& world, Random& random, bool forges) {
  switch (random.below(forges ? 8 : 7)) {
    case 0:
      world.base_is_there = !world.base_is_there;
      break;
    case 1:  // it is started again
      ++world.base;
      break;
    case 2:
      world.link_.loss_per_mille = random.below(2) * random.below(300);
      break;
    case 3:
      world.link_.answer_loss_per_mille = random.below(2) * random.below(800);
      break;
    case 4:
      world.link_.answer_repeat_per_mille = random.below(2) * random.below(500);
      break;
    case 5:
      world.window_bytes = random.below(3) == 0 ? 65536 : 65536 + random.below(16000000);
      break;
    case 6:
      world.link_.bytes_per_second = random_link(random).bytes_per_second;
      break;
    default:
      (void)world.pacing.take(forged_receipt(random), world.now_ns());
  }
}

}  // namespace

TEST_CASE("whatever link and base do, the rate stays within bounds and everything arrives") {
  const bool forges = GENERATE(false, true);
  int delivered = 0;
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    Random random(seed);
    SimulatedLink world(random_link(random), {kMinimum, kMaximum, 250e3}, true, seed);
    CAPTURE(seed, forges, world.link_.bytes_per_second);
    for (int i = 0; i < 40; ++i) {
      if (random.below(3) == 0) world.publish(1 + random.below(60), random.below(4));
      if (random.below(2) == 0) disturb(world, random, forges);
      world.run(world.now_ns() + kSecond / 2);
      REQUIRE(world.pacing.rate() >= kMinimum);
      REQUIRE(world.pacing.rate() <= kMaximum);
    }
    CHECK_FALSE(world.exceeded_window);
    world.base_is_there = true;
    world.link_.loss_per_mille = 0;
    world.link_.answer_loss_per_mille = 0;
    world.link_.answer_repeat_per_mille = 0;
    world.window_bytes = 1000000;
    // As long as the slowest link needs for all of it, and a minute to find the rate again.
    const std::int64_t end = world.now_ns() + 360 * kSecond;
    while (!world.is_idle() && world.now_ns() < end) world.run(world.now_ns() + kSecond);
    REQUIRE(world.is_idle());
    delivered += static_cast<int>(world.keyframes.size());
  }
  CHECK(delivered > 1000);
}
