// Tests of the standard deviations of keyframe positions in a merged map.
#include "src/merge/position_sigma.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/merge/two_sessions.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::TwoSessions;

namespace {

std::vector<std::vector<double>> sigmas_of(const TwoSessions& site) {
  return position_sigmas_m(site.sessions, site.result, OdometryNoiseConfig{});
}

/// The second session is no part of the map.
TwoSessions one_session() {
  TwoSessions site;
  site.result.sessions[1].status = SessionStatus::kUnconnected;
  return site;
}

}  // namespace

TEST_CASE("without loops a position is known less the farther odometry has come") {
  const auto sigmas = sigmas_of(one_session());
  REQUIRE(sigmas[0].size() == 6);
  CHECK(sigmas[0][0] == 0.0);
  CHECK(sigmas[0][1] > 0.0);
  CHECK(std::is_sorted(sigmas[0].begin(), sigmas[0].end()));
  CHECK(sigmas[1].empty());
  // Along the path by random errors of each step, across by those of heading with their lever.
  CHECK(sigmas[0][5] > std::sqrt(5.0) * sigmas[0][1]);
}

TEST_CASE("a loop back to the start makes the end as sure as itself, and the middle least") {
  TwoSessions site = one_session();
  const auto open = sigmas_of(site);
  site.loop({0, 5}, {0, 0}, 0.01, 0.001);
  const auto closed = sigmas_of(site);
  CHECK(closed[0][5] < 0.06);
  CHECK(closed[0][3] < open[0][3]);
  CHECK(std::max_element(closed[0].begin(), closed[0].end()) - closed[0].begin() < 5);
}

TEST_CASE("another session is as sure as the loop that ties it, and what that is tied to") {
  TwoSessions site;
  site.loop({1, 0}, {0, 3}, 0.5, 0.02);
  const auto sigmas = sigmas_of(site);
  const auto alone = sigmas_of(one_session());
  CHECK(sigmas[0][5] == Approx(alone[0][5]));
  CHECK(sigmas[1][0] > std::hypot(alone[0][3], 0.49));
  CHECK(sigmas[1][5] > sigmas[1][0]);
}

TEST_CASE("the loops of a session that is not in the map are no part of it") {
  TwoSessions last = one_session();
  const auto alone = sigmas_of(last);
  last.loop({1, 5}, {1, 0}, 0.01, 0.001);
  CHECK(sigmas_of(last) == alone);

  TwoSessions first;
  first.result.sessions[0].status = SessionStatus::kUnconnected;
  first.result.sessions[1].status = SessionStatus::kCentral;
  const auto without = sigmas_of(first);
  first.loop({0, 5}, {0, 0}, 0.01, 0.001);
  CHECK(sigmas_of(first) == without);
}

TEST_CASE("a session in the map that nothing ties has no deviation, nor has any other") {
  const auto sigmas = sigmas_of(TwoSessions());
  CHECK(sigmas[0].empty());
  CHECK(sigmas[1].empty());
}
