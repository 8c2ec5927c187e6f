// Decisions of alignment on what the sensor data say about a placement
#include "tests/merge/alignment_scene.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// Two sessions side by side; their loops span the given path and overlap little if it is short.
Scene side_by_side(double span_m) {
  Scene scene = beside_each_other({60, 60});
  const auto last = static_cast<std::size_t>(span_m / kStepM);
  const bool is_short = span_m < AcceptanceConfig{}.min_span_m;
  for (std::size_t k = 0; k <= last; k += is_short ? 1 : 2) {
    scene.loops.push_back(exact_loop({1, k}, {0, k}));
    if (is_short) scene.loops.back().overlap = 0.5;
  }
  return scene;
}

constexpr double kOnePlaceM = 50.0;
constexpr double kManyPlacesM = 200.0;

Alignment aligned(double span_m, const PlacementEvidence& evidence) {
  return align(side_by_side(span_m), {}, [&](const Placement& placement) {
    CHECK_FALSE(placement.loops.empty());
    CHECK(placement.T_query_session_keyframe.size() == 60);
    CHECK(placement.T_match_session_query_session.translation.norm() < 1e-6);
    return evidence;
  });
}

}  // namespace

TEST_CASE("Loops in one place connect two maps only if data confirm them elsewhere",
          "[alignment]") {
  const Alignment unasked = align(side_by_side(kOnePlaceM));
  CHECK_FALSE(unasked.connected[1]);
  REQUIRE(unasked.pairs.size() == 1);
  CHECK(unasked.pairs[0].state == PairState::kProvisional);
  CHECK(unasked.reason[1] == "all loops lie in one place, and nothing confirms them elsewhere");
  for (const LoopDecision& decision : unasked.decisions) {
    CHECK_FALSE(decision.accepted);
    CHECK(decision.reason == unasked.reason[1]);
  }
  const std::size_t enough = AcceptanceConfig{}.min_loops;
  CHECK_FALSE(aligned(kOnePlaceM, {enough - 1, 0, {}}).connected[1]);
  const Alignment confirmed = aligned(kOnePlaceM, {enough, 0, {}});
  CHECK(confirmed.connected[1]);
  CHECK(confirmed.pairs[0].state == PairState::kConfirmed);
  CHECK(confirmed.pairs[0].reason.empty());
}

TEST_CASE("Loops over a short path connect two maps only if data confirm them", "[alignment]") {
  constexpr double kShortM = 15.0;
  const Alignment unasked = align(side_by_side(kShortM));
  CHECK_FALSE(unasked.connected[1]);
  CHECK(unasked.pairs.at(0).state == PairState::kProvisional);
  CHECK(unasked.reason[1] == "loops span too short a path; too few keyframes confirm them: 0 of 0");
  CHECK_FALSE(aligned(kShortM, {5, 3, {}}).connected[1]);
  CHECK_FALSE(aligned(kShortM, {5, 0, "the walls do not fit"}).connected[1]);
  const Alignment confirmed = aligned(kShortM, {5, 2, {}});
  CHECK(confirmed.connected[1]);
  CHECK(confirmed.pairs.at(0).reason.empty());
}

TEST_CASE("Loops at many places need no confirmation, but no contradiction or repetition either",
          "[alignment]") {
  CHECK(aligned(kManyPlacesM, {0, 0, {}}).connected[1]);
  CHECK(aligned(kManyPlacesM, {4, 8, {}}).connected[1]);
  CHECK_FALSE(aligned(kManyPlacesM, {0, 1, {}}).connected[1]);
  const Alignment contradicted = aligned(kManyPlacesM, {4, 9, {}});
  CHECK_FALSE(contradicted.connected[1]);
  CHECK(contradicted.pairs[0].state == PairState::kProvisional);
  CHECK(contradicted.reason[1] == "keyframes beside each other see different structure: 9 of 13");

  const Alignment repeated = aligned(kManyPlacesM, {9, 0, "the surroundings repeat"});
  CHECK_FALSE(repeated.connected[1]);
  CHECK(repeated.pairs[0].state == PairState::kProvisional);
  CHECK(repeated.reason[1] == "the surroundings repeat");
  CHECK(repeated.pairs[0].loops == 21);
}

TEST_CASE("Of two placements that loops bear out the data may exclude one", "[alignment]") {
  Scene scene = side_by_side(kManyPlacesM);
  // As many loops say that the query drives 100 m farther on.
  for (std::size_t k = 1; k < 31; k += 2) {
    scene.loops.push_back(exact_loop({1, k}, {0, k + 20}));
  }
  const auto with = [&](std::size_t excluded, const std::string& aliasing) {
    return align(scene, {}, [&](const Placement& placement) {
      REQUIRE(placement.competing.size() == 1);
      CHECK(apart_m(placement.competing[0].T_match_session_query_session, shifted(100.0)) < 1.0);
      return PlacementEvidence{9, 0, aliasing, excluded};
    });
  };
  const Alignment unasked = align(scene);
  CHECK_FALSE(unasked.connected[1]);
  CHECK_THAT(unasked.reason[1], Catch::Matchers::Contains("ambiguous: "));
  const Alignment excluded = with(1, {});
  CHECK(excluded.connected[1]);
  CHECK(excluded.pairs[0].state == PairState::kConfirmed);
  CHECK(excluded.T_map_session[1].translation.norm() < 0.1);
  CHECK(excluded.decisions[0].accepted);
  CHECK_FALSE(excluded.decisions.back().accepted);
  const Alignment undecided = with(0, {});
  CHECK_FALSE(undecided.connected[1]);
  CHECK(undecided.pairs[0].state == PairState::kProvisional);
  CHECK_THAT(undecided.reason[1], Catch::Matchers::Contains("ambiguous: ") &&
                                      Catch::Matchers::Contains("; nothing excludes"));
  CHECK_FALSE(with(1, "the surroundings repeat").connected[1]);
}

TEST_CASE("Data are asked once about pairs that connect sessions, a later session's last",
          "[alignment]") {
  // The last session has most loops, and loops with both others.
  Scene scene = beside_each_other({60, 60, 60});
  connect_side_by_side(scene.loops, 1, 0, 60, 4);
  connect_side_by_side(scene.loops, 2, 0, 60);
  connect_side_by_side(scene.loops, 2, 1, 60);
  std::vector<std::size_t> asked_of_query;
  const Alignment alignment = align(scene, {}, [&](const Placement& placement) {
    asked_of_query.push_back(placement.loops.front().query.session);
    return PlacementEvidence{5, 0, {}};
  });
  CHECK((asked_of_query == std::vector<std::size_t>{1, 2}));
  CHECK(alignment.connected == std::vector<bool>(3, true));
}
