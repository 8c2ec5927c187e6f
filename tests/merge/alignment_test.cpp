// Alignment under outliers, and of sessions that are hardly any.
#include "unimapper/merge/alignment.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>
#include <utility>

#include "tests/merge/alignment_scene.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

struct Tally {
  int right = 0;
  int wrong = 0;
  int refused = 0;
};

Tally trials(std::size_t true_loops, std::size_t random_loops, std::size_t aliased_loops) {
  Tally tally;
  for (std::uint64_t trial = 0; trial < 15; ++trial) {
    Random random(1000 * true_loops + 100 * random_loops + 10 * aliased_loops + trial);
    Scene scene = two_maps(random);
    if (true_loops > 0) add_true_loops(scene, true_loops, random);
    add_random_loops(scene, random_loops, random);
    if (aliased_loops > 0) add_aliased_loops(scene, aliased_loops, random);
    const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
    if (!alignment.connected[0] || !alignment.connected[1]) {
      ++tally.refused;
    } else if (overlap_error_m(scene, alignment) < 1.5) {
      ++tally.right;
    } else {
      ++tally.wrong;
    }
  }
  return tally;
}

}  // namespace

TEST_CASE("True loops alone merge two maps", "[alignment]") {
  const Tally tally = trials(10, 0, 0);
  CHECK(tally.right == 15);
}

TEST_CASE("True loops win over twice or thrice as many random false ones", "[alignment]") {
  CHECK(trials(10, 1, 0).right == 15);
  CHECK(trials(10, 20, 0).right == 15);
  CHECK(trials(10, 30, 0).right == 15);
  CHECK(trials(5, 20, 0).wrong == 0);
}

TEST_CASE("Random false loops alone never merge two maps", "[alignment]") {
  CHECK(trials(0, 15, 0).refused == 15);
  CHECK(trials(0, 60, 0).refused == 15);
}

TEST_CASE("Perceptual aliasing leads to a refusal, not to a wrong map", "[alignment]") {
  CHECK(trials(10, 0, 12).refused == 15);
  CHECK(trials(10, 0, 6).wrong == 0);
  CHECK(trials(0, 0, 2).refused == 15);
}

TEST_CASE("Few true loops merge rightly or not at all", "[alignment]") {
  const Tally tally = trials(3, 10, 0);
  CHECK(tally.wrong <= 2);  // three loops of 0.3 m noise leave 1.5 to 2.5 m here and there
  CHECK(tally.right >= 8);
}

TEST_CASE("A refused session keeps every keyframe and says why", "[alignment]") {
  Random random(7);
  Scene scene = two_maps(random);
  add_random_loops(scene, 15, random);
  const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE_FALSE(alignment.connected[1]);
  CHECK(alignment.T_session_keyframe[1].size() == 160);
  CHECK_FALSE(alignment.reason[1].empty());
  for (const auto& decision : alignment.decisions) {
    CHECK_FALSE(decision.accepted);
    CHECK_FALSE(decision.reason.empty());
  }
}

TEST_CASE("The same loops seen from either side give the same map", "[alignment]") {
  Random random(8);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  const Alignment there = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  for (auto& l : scene.loops) {
    std::swap(l.query, l.match);
    l.T_match_query = l.T_match_query.inverse();
  }
  const Alignment back = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(back.connected[1]);
  // The measurement's error now sits in the other frame, so the optimum moves by part of it.
  CHECK((there.T_map_keyframe({1, 40}).translation - back.T_map_keyframe({1, 40}).translation)
            .norm() < 0.5);
}

TEST_CASE("The order of sessions does not change the map", "[alignment]") {
  Random random(9);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  const Alignment forward = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  std::swap(scene.sessions[0], scene.sessions[1]);
  for (auto& l : scene.loops) {
    l.query.session = 1 - l.query.session;
    l.match.session = 1 - l.match.session;
  }
  const Alignment reverse = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  CHECK(forward.central == 0);
  CHECK(reverse.central == 1);
  for (const std::size_t k : {0U, 70U, 150U}) {
    CHECK((forward.T_map_keyframe({1, k}).translation - reverse.T_map_keyframe({0, k}).translation)
              .norm() < 0.01);
  }
}

TEST_CASE("Intra-session loops correct drift, a false one does not deform the map", "[alignment]") {
  Random random(12);
  std::vector<Pose> truth;
  // Twice around a block of 100 m by 100 m.
  for (int i = 0; i < 160; ++i) {
    const int side = i / 20 % 4;
    const double along = 5.0 * (i % 20);
    const Eigen::Vector3d corners[] = {{0, 0, 0}, {100, 0, 0}, {100, 100, 0}, {0, 100, 0}};
    truth.push_back(yaw_pose(1.5708 * side, corners[side]) * yaw_pose(0.0, {along, 0.0, 0.0}));
  }
  Scene scene;
  scene.truth = {truth};
  scene.sessions.push_back({odometry(random, truth), 1.0});
  for (std::size_t i = 0; i < 16; ++i) loop(scene, {0, 80 + 5 * i}, {0, 5 * i}, Pose{}, random);
  loop(scene, {0, 150}, {0, 20}, Pose{}, random);  // the far corner, taken for this one
  const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  CHECK(alignment.connected[0]);
  CHECK_FALSE(alignment.decisions.back().accepted);
  CHECK(alignment.decisions.back().reason ==
        "disagrees with odometry or with the session's other loops");
  std::size_t accepted = 0;
  for (const auto& decision : alignment.decisions) accepted += decision.accepted ? 1 : 0;
  CHECK(accepted >= 14);
  const auto gap = [&](const std::vector<Pose>& poses) {
    return (poses[155].translation - poses[75].translation).norm();
  };
  CHECK(gap(alignment.T_session_keyframe[0]) < 0.5);
}

TEST_CASE("Sessions without keyframes and loops to nowhere", "[alignment]") {
  Random random(14);
  Scene scene = two_maps(random);
  scene.sessions.push_back({{}, 0.0});
  SECTION("an empty session stays apart") {
    add_true_loops(scene, 10, random);
    const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
    CHECK(alignment.connected[1]);
    CHECK_FALSE(alignment.connected[2]);
    CHECK(alignment.reason[2] == "no keyframes");
  }
  SECTION("a loop to a keyframe that is not there is refused") {
    loop(scene, {1, 0}, {0, 999}, Pose{}, random);
    CHECK_THROWS_AS(align_sessions(scene.sessions, scene.loops, MergeConfig{}),
                    std::invalid_argument);
  }
  SECTION("no sessions at all") { CHECK(align_sessions({}, {}, MergeConfig{}).connected.empty()); }
}

TEST_CASE("A loop of a keyframe to itself is refused", "[alignment]") {
  Scene scene;
  scene.sessions = {{straight(5), 1.0}};
  scene.loops.push_back(exact_loop({0, 2}, {0, 2}, Pose{}));
  CHECK_THROWS_WITH(align_sessions(scene.sessions, scene.loops, MergeConfig{}),
                    "loop of a keyframe to itself");
  scene.loops[0].query = {0, 5};
  CHECK_THROWS_WITH(align_sessions(scene.sessions, scene.loops, MergeConfig{}),
                    "loop between keyframes that do not exist");
  scene.loops[0].query = {1, 0};
  CHECK_THROWS_WITH(align_sessions(scene.sessions, scene.loops, MergeConfig{}),
                    "loop between keyframes that do not exist");
  scene.loops[0].query = {0, 4};
  CHECK_NOTHROW(align_sessions(scene.sessions, scene.loops, MergeConfig{}));
}
