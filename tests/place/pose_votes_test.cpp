// Tests of voting on poses.
#include "src/place/pose_votes.hpp"

#include "synthetic_place.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;
using test::Random;

constexpr double kTurn = 2.0 * 3.14159265358979323846;

LoopSearchConfig small() {
  LoopSearchConfig config;
  config.max_places = 100;
  config.max_matches = 4096;
  return config;
}

// A triangle at (x, y) in the query's frame that votes for a pose, with a little noise.
PoseVote vote(std::uint32_t slot, double yaw, double x, double y, Random& random,
              double noise = 0.1) {
  const double qx = random.uniform(-30, 30);
  const double qy = random.uniform(-30, 30);
  const double turned = yaw + random.uniform(-noise, noise) * 0.1;
  const double sx = std::cos(yaw) * qx - std::sin(yaw) * qy + x + random.uniform(-noise, noise);
  const double sy = std::sin(yaw) * qx + std::cos(yaw) * qy + y + random.uniform(-noise, noise);
  const auto cm = [](double metres) {
    return static_cast<std::int16_t>(std::lround(metres * 100));
  };
  const auto turn = static_cast<std::uint16_t>(static_cast<std::int64_t>(turned / kTurn * 65536.0));
  return {slot, turn, {cm(qx), cm(qy)}, {cm(sx), cm(sy)}, 2};
}

}  // namespace

TEST_CASE("a pose that eight votes agree on stands out among three thousand") {
  Owned<PoseVotes> votes(small());
  for (const double yaw : {0.3, 2.0, 3.1, 4.7, 6.2}) {
    Random random(static_cast<std::uint64_t>(yaw * 10));
    votes->clear();
    for (std::uint32_t i = 0; i < 3000; ++i) {
      const double turn = random.uniform(0, kTurn);
      const double x = random.uniform(-60, 60);
      votes->add(vote(i % 100, turn, x, random.uniform(-60, 60), random));
    }
    for (int i = 0; i < 8; ++i) votes->add(vote(42, yaw, 11.8, -24.1, random));
    const auto peaks = votes->peaks();
    const auto peak = std::max_element(
        peaks.begin(), peaks.end(),
        [](const PosePeak& a, const PosePeak& b) { return a.support < b.support; });
    REQUIRE(peak != peaks.end());
    CHECK(peak->slot == 42);
    CHECK(peak->support >= 14);
    CHECK(peak->T_place_query.x == Approx(11.8).margin(0.5));
    CHECK(peak->T_place_query.y == Approx(-24.1).margin(0.5));
    CHECK(peak->T_place_query.cosine == Approx(std::cos(yaw)).margin(0.02));
    CHECK(peak->T_place_query.sine == Approx(std::sin(yaw)).margin(0.02));
  }
}

TEST_CASE("a place may have two peaks: two spots that look alike") {
  Owned<PoseVotes> votes(small());
  Random random(3);
  for (int i = 0; i < 9; ++i) votes->add(vote(7, 1.0, 5, 5, random));
  for (int i = 0; i < 6; ++i) votes->add(vote(7, 1.0, 17, 5, random));
  const auto peaks = votes->peaks();
  REQUIRE(peaks.size() == 2);
  CHECK(peaks[0].support == 18);
  CHECK(peaks[0].T_place_query.x == Approx(5).margin(0.4));
  CHECK(peaks[1].support == 12);
  CHECK(peaks[1].T_place_query.x == Approx(17).margin(0.4));
}

TEST_CASE("votes that stand alone make no peak, and clearing forgets everything") {
  Owned<PoseVotes> votes(small());
  CHECK(votes->peaks().empty());
  Random random(4);
  votes->add(vote(7, 1.0, 5, 5, random));
  votes->add(vote(8, 1.0, 5, 5, random));
  CHECK(votes->peaks().empty());
  votes->add(vote(7, 1.0, 5, 5, random));
  CHECK(votes->peaks().size() == 1);
  votes->clear();
  CHECK(votes->peaks().empty());
}

TEST_CASE("more votes than there is room for are counted, and the same votes give the same peaks") {
  LoopSearchConfig config = small();
  config.max_matches = 64;
  Owned<PoseVotes> votes(config);
  for (int round = 0; round < 2; ++round) {
    Random random(5);
    votes->clear();
    for (int i = 0; i < 100; ++i) votes->add(vote(7, 1.0, 5, 5, random));
    CHECK(votes->refused() == 36);
    const auto peaks = votes->peaks();
    REQUIRE(peaks.size() == 1);
    CHECK(peaks[0].support == 128);
  }
}

TEST_CASE("votes that all fall into one cell are examined up to a limit") {
  Owned<PoseVotes> votes(small());
  Random random(6);
  for (int i = 0; i < 4096; ++i)
    votes->add(vote(static_cast<std::uint32_t>(i % 3), 1.0, 5, 5, random));
  const auto peaks = votes->peaks();
  REQUIRE(peaks.size() == 3);
  // Only so many votes of a place are examined.
  for (const PosePeak& peak : peaks) CHECK(peak.support == 256);
}
