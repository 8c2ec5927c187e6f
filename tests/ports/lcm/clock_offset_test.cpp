// Tests of the offset between the clocks of robot and base, with simulated clocks.
#include "ports/lcm/clock_offset.hpp"

#include "tests/test.hpp"
#include "tests/wire/records.hpp"

using namespace unimapper;
using lcm_port::ClockOffsetFilter;

namespace {

constexpr std::int64_t kMs = 1000000;
constexpr std::int64_t kSecond = 1000 * kMs;

/// Two computers and the way between them. An epoch is Unix time less the robot's steady clock.
struct Clocks {
  std::int64_t steady_ns = 5 * kSecond;
  std::int64_t robot_epoch_ns = 1700000000 * kSecond;
  std::int64_t base_epoch_ns = 1700000003 * kSecond;
  double base_drift_ppm = 0.0;
  std::int64_t there_ns = 2 * kMs;
  std::int64_t back_ns = 2 * kMs;
  ClockOffsetFilter filter;

  [[nodiscard]] std::int64_t base_time() const {
    const double drift = static_cast<double>(steady_ns) * base_drift_ppm * 1e-6;
    return steady_ns + base_epoch_ns + static_cast<std::int64_t>(drift);
  }
  [[nodiscard]] std::int64_t truth() const { return base_time() - (steady_ns + robot_epoch_ns); }

  /// Probes and their answers.
  void exchange(int probes = 1) {
    for (int i = 0; i < probes; ++i) {
      const std::int64_t sent = steady_ns;
      steady_ns += there_ns;
      const std::int64_t base = base_time();
      steady_ns += back_ns;
      filter.add(sent, base, there_ns + back_ns);
    }
  }
  wire::ClockOffset offset() {
    const auto offset = filter.offset({steady_ns, steady_ns + robot_epoch_ns});
    REQUIRE(offset);
    return *offset;
  }
  void check_right() {
    const wire::ClockOffset known = offset();
    CHECK(std::abs(known.base_minus_robot_ns - truth()) <= known.uncertainty_ns);
  }
};

}  // namespace

TEST_CASE("an even way gives the offset, and half the round trip bounds it") {
  Clocks clocks;
  clocks.exchange();
  CHECK(clocks.offset().base_minus_robot_ns == 3 * kSecond);
  CHECK(clocks.offset().uncertainty_ns >= 2 * kMs);
  CHECK(clocks.offset().uncertainty_ns < 3 * kMs);
}

TEST_CASE("of ways that queue up unevenly the shortest one counts") {
  wire::wire_test::Random random(4);
  Clocks clocks;
  clocks.base_drift_ppm = 30.0;
  for (int i = 0; i < 600; ++i) {
    clocks.there_ns = kMs + random.below(100) * kMs * (random.below(3) == 0 ? 0 : 1);
    clocks.back_ns = kMs;
    clocks.exchange();
    clocks.check_right();
    if (i > 20) CHECK(clocks.offset().uncertainty_ns < 20 * kMs);
    clocks.steady_ns += kSecond;
  }
  CHECK(clocks.offset().steps == 0);
}

TEST_CASE("a robot whose clock is set knows the new offset at once") {
  Clocks clocks;
  clocks.exchange(10);
  const std::int64_t step = GENERATE(-3600 * kSecond, 3600 * kSecond, 50 * kMs);
  (void)clocks.offset();
  clocks.robot_epoch_ns += step;
  clocks.check_right();
  CHECK(clocks.offset().steps == 1);
  CHECK(clocks.offset().base_minus_robot_ns == 3 * kSecond - step);
}

TEST_CASE("a base whose clock is set is followed after two answers") {
  Clocks clocks;
  clocks.exchange(10);
  const std::int64_t step = GENERATE(-3600 * kSecond, 3600 * kSecond, 50 * kMs);
  clocks.base_epoch_ns += step;
  clocks.exchange();
  CHECK(clocks.offset().base_minus_robot_ns == 3 * kSecond);
  clocks.exchange();
  clocks.check_right();
  CHECK(clocks.offset().base_minus_robot_ns == 3 * kSecond + step);
  CHECK(clocks.offset().steps == 1);
}

TEST_CASE("a single answer that contradicts all others changes nothing") {
  Clocks clocks;
  clocks.exchange(10);
  clocks.filter.add(clocks.steady_ns, 77, 2 * kMs);
  clocks.exchange();
  clocks.filter.add(clocks.steady_ns, 1, 2 * kMs);
  clocks.check_right();
  CHECK(clocks.offset().steps == 0);
}

TEST_CASE("times that no clock shows are not used") {
  ClockOffsetFilter filter;
  CHECK_FALSE(filter.offset({1, 2}));
  filter.add(0, -1, 5);
  filter.add(0, INT64_MAX, 5);
  filter.add(0, 5, -1);
  CHECK_FALSE(filter.offset({1, 2}));
}
