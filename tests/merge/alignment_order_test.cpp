// Centre, start and order of alignment.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/merge/alignment_scene.hpp"
#include "unimapper/merge/alignment.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

TEST_CASE("A map that overlaps only another query map is reached through it", "[alignment]") {
  Random random(10);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  // The third robot drives only the street that the second one does not share.
  std::vector<Pose> third(scene.truth[1].begin() + 90, scene.truth[1].begin() + 150);
  scene.truth.push_back(third);
  scene.sessions.push_back({odometry(random, third), 0.1});
  for (std::size_t i = 0; i < 8; ++i) {
    loop(scene, {2, 6 * i}, {1, 90 + 6 * i}, Pose{}, random);
  }
  const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(alignment.central == 0);
  REQUIRE(alignment.connected[2]);
  CHECK((alignment.T_map_keyframe({1, 120}).translation -
         alignment.T_map_keyframe({2, 30}).translation)
            .norm() < 1.0);
}

TEST_CASE("A pair that contradicts a cycle of maps is rolled back", "[alignment]") {
  Random random(11);
  Scene scene = two_maps(random);
  add_true_loops(scene, 12, random);
  std::vector<Pose> third(scene.truth[0].begin(), scene.truth[0].begin() + 200);
  scene.truth.push_back(third);
  scene.sessions.push_back({odometry(random, third), 0.1});
  for (std::size_t i = 0; i < 10; ++i) loop(scene, {2, 18 * i}, {0, 18 * i}, Pose{}, random);
  const std::size_t first_wrong = scene.loops.size();
  // Loops that shift the third map 40 m against the second.
  const Pose aside = yaw_pose(0.0, {0.0, 40.0, 0.0});
  const std::size_t shared = nearest(scene.truth[0], scene.truth[1][0]);
  for (std::size_t i = 0; i < 5 && shared + 3 * i < 200; ++i) {
    loop(scene, {2, shared + 3 * i}, {1, 3 * i}, aside, random);
  }
  const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(alignment.connected[1]);
  REQUIRE(alignment.connected[2]);
  CHECK(overlap_error_m(scene, alignment) < 1.5);
  for (std::size_t i = first_wrong; i < scene.loops.size(); ++i) {
    CHECK_FALSE(alignment.decisions[i].accepted);
    CHECK(alignment.decisions[i].reason == "contradicts the maps merged before");
  }
}

TEST_CASE("The central session is the best of those that most keyframes are connected to",
          "[alignment]") {
  // Two connected sessions of 40 keyframes, and one apart that has the best score.
  const auto align = [](std::size_t keyframes_apart) {
    Scene scene;
    scene.sessions = {{straight(40), 1.0}, {straight(keyframes_apart), 9.0}, {straight(40), 2.0}};
    connect_side_by_side(scene.loops, 2, 0, 40);
    return align_sessions(scene.sessions, scene.loops, MergeConfig{});
  };
  const Alignment fewer = align(79);
  CHECK(fewer.central == 2);
  CHECK(fewer.connected == std::vector<bool>{true, false, true});
  CHECK(fewer.reason[1] == "no loops found");
  CHECK(fewer.reason[0].empty());
  // As many: the score decides.
  const Alignment as_many = align(80);
  CHECK(as_many.central == 1);
  CHECK(as_many.connected == std::vector<bool>{false, true, false});
}

TEST_CASE("The central session's first keyframe defines the map", "[alignment]") {
  Scene scene;
  scene.sessions = {{straight(40), 1.0}, {straight(40), 2.0}};
  for (Pose& pose : scene.sessions[1].T_odometry_keyframe) {
    pose = yaw_pose(2.5, {700.0, -300.0, 9.0}) * pose;
  }
  connect_side_by_side(scene.loops, 1, 0, 40);
  const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(alignment.central == 1);
  REQUIRE(alignment.connected[0]);
  CHECK((alignment.T_map_session[1].translation).norm() == 0.0);
  for (const std::size_t k : {0U, 17U, 39U}) {
    CHECK((alignment.T_map_keyframe({0, k}).translation -
           alignment.T_map_keyframe({1, k}).translation)
              .norm() < 1e-3);
  }
}

TEST_CASE("A session that stays apart names the reason of its strongest pair", "[alignment]") {
  Scene scene;
  scene.sessions = {{straight(40), 2.0}, {straight(40), 1.0}, {straight(40), 0.5}};
  connect_side_by_side(scene.loops, 1, 0, 40);
  const auto reason = [&] {
    const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
    REQUIRE(alignment.connected[1]);
    REQUIRE_FALSE(alignment.connected[2]);
    return alignment.reason[2];
  };
  CHECK(reason() == "no loops found");
  LoopConstraint weak = exact_loop({2, 20}, {1, 20}, Pose{});
  scene.loops.push_back(weak);
  CHECK(reason() == "too few consistent loops: 1 of 1");
  // Two of them are more, if they do not overlap strongly.
  weak = exact_loop({2, 10}, {0, 10}, Pose{});
  weak.overlap = 0.1;
  scene.loops.push_back(weak);
  weak.query.keyframe = weak.match.keyframe = 30;
  scene.loops.push_back(weak);
  CHECK(reason() == "too few consistent loops: 2 of 2");
}

TEST_CASE("A session starts where the loops with a connected one put it, whichever is the match",
          "[alignment]") {
  // A chain of three sessions, each with an odometry frame of its own. A single step of the solver
  // is enough from the right start and from no other.
  const Pose frames[] = {yaw_pose(0.4, {20.0, 5.0, 1.0}), yaw_pose(2.5, {700.0, -300.0, 9.0}),
                         yaw_pose(-1.9, {-40.0, 900.0, -5.0})};
  std::vector<std::size_t> chain{0, 1, 2};
  do {
    INFO("chain " << chain[0] << chain[1] << chain[2]);
    Scene scene;
    for (const Pose& frame : frames) {
      scene.sessions.push_back({straight(40), 0.5});
      for (Pose& pose : scene.sessions.back().T_odometry_keyframe) pose = frame * pose;
    }
    scene.sessions[chain[0]].central_score = 1.0;
    connect_side_by_side(scene.loops, chain[1], chain[0], 40);
    connect_side_by_side(scene.loops, chain[2], chain[1], 40);
    MergeConfig config;
    config.graph.max_iterations = 1;
    const Alignment alignment = align_sessions(scene.sessions, scene.loops, config);
    REQUIRE(alignment.central == chain[0]);
    REQUIRE(alignment.connected == std::vector<bool>{true, true, true});
    for (std::size_t s = 0; s < 3; ++s) {
      for (const std::size_t k : {0U, 39U}) {
        CHECK((alignment.T_map_keyframe({s, k}).translation -
               alignment.T_map_keyframe({chain[0], k}).translation)
                  .norm() < 1e-3);
      }
    }
  } while (std::next_permutation(chain.begin(), chain.end()));
}

TEST_CASE("Of two pairs that contradict each other the one with more distinct loops is joined",
          "[alignment]") {
  // The third session lies beside the second and aside of the first, which lie beside each other.
  const auto align = [](std::size_t with_first, std::size_t with_second) {
    Scene scene;
    scene.sessions = {{straight(60), 2.0}, {straight(60), 1.0}, {straight(60), 0.5}};
    connect_side_by_side(scene.loops, 1, 0, 60);
    for (std::size_t i = 0; i < with_first; ++i) {
      scene.loops.push_back(exact_loop({2, 5 * i}, {0, 5 * i}, yaw_pose(0.0, {0.0, 40.0, 0.0})));
    }
    for (std::size_t i = 0; i < with_second; ++i) {
      scene.loops.push_back(exact_loop({2, 5 * i}, {1, 5 * i}, Pose{}));
    }
    const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
    REQUIRE(alignment.central == 0);
    REQUIRE(alignment.connected == std::vector<bool>{true, true, true});
    for (std::size_t i = 0; i < scene.loops.size(); ++i) {
      const bool of_first = i >= 30 && i < 30 + with_first;
      const bool of_second = i >= 30 + with_first;
      const bool weaker = with_first < with_second ? of_first : of_second;
      CHECK(alignment.decisions[i].accepted == !weaker);
      CHECK(alignment.decisions[i].reason == (weaker ? "contradicts the maps merged before" : ""));
    }
    return alignment.T_map_keyframe({2, 20}).translation.y();
  };
  CHECK(align(8, 9) == Approx(0.0).margin(1e-3));
  CHECK(align(9, 8) == Approx(40.0).margin(1e-3));
}

TEST_CASE("Pairs that close a cycle of sessions are joined after those that connect one",
          "[alignment]") {
  // Ten loops along the first half of the central session, six of which must give way to the
  // second session, which is longer there. Two more sessions lie beside the second half, and the
  // pair of them is stronger than that of the second session. Had it come first, its loops would
  // make the six less than a tenth of the earlier ones.
  constexpr std::size_t kHalf = 41;
  Scene scene;
  std::vector<Pose> longer = straight(kHalf);
  for (std::size_t k = 1; k < kHalf; ++k) {
    const bool stretched = (k - 1) / 4 < 6 && (k - 1) % 4 < 2;
    longer[k].translation.x() = longer[k - 1].translation.x() + (stretched ? 2.0 : 1.0) * kStepM;
  }
  scene.sessions = {
      {straight(kHalf + 50), 9.0}, {longer, 0.5}, {straight(50), 0.4}, {straight(50), 0.3}};
  Pose two_steps;
  two_steps.translation.x() = 2.0 * kStepM;
  for (std::size_t j = 0; j < 10; ++j) {
    scene.loops.push_back(exact_loop({0, 4 * j + 2}, {0, 4 * j}, two_steps));
  }
  const std::size_t intra = scene.loops.size();
  for (std::size_t k = 0; k < 26; k += 2) {
    scene.loops.push_back(exact_loop({1, k}, {0, k}, Pose{}, 0.001));
  }
  const std::size_t contradicting = scene.loops.size();
  for (const std::size_t session : {2U, 3U}) {
    for (std::size_t k = 0; k < 46; k += 2) {
      scene.loops.push_back(exact_loop({session, k}, {0, kHalf + k}, Pose{}));
    }
  }
  for (std::size_t k = 0; k < 40; k += 2) scene.loops.push_back(exact_loop({3, k}, {2, k}, Pose{}));
  MergeConfig config;
  config.acceptance.consistency_chi2 = 1e9;
  config.graph.cauchy_scale = 1e6;
  config.graph.deformation_floor_m = 1000.0;
  const Alignment alignment = align_sessions(scene.sessions, scene.loops, config);
  REQUIRE(alignment.central == 0);
  CHECK(alignment.connected == std::vector<bool>{true, false, true, true});
  for (std::size_t i = 0; i < scene.loops.size(); ++i) {
    CHECK(alignment.decisions[i].accepted == (i < intra || i >= contradicting));
  }
}

TEST_CASE("Among many pairs that are joined together only the wrong one is refused",
          "[alignment]") {
  // Nine sessions along one street, each tied to the next two; the last one to the first as well,
  // 30 m off.
  constexpr std::size_t kSessions = 9;
  Random random(12);
  Scene scene;
  const std::vector<Pose> street = straight(40);
  for (std::size_t s = 0; s < kSessions; ++s) {
    scene.truth.push_back(street);
    scene.sessions.push_back({odometry(random, street), 1.0});
  }
  for (std::size_t s = 0; s < kSessions; ++s) {
    for (std::size_t next = s + 1; next < std::min(s + 3, kSessions); ++next) {
      for (std::size_t k = 0; k < 40; k += 3) loop(scene, {next, k}, {s, k}, Pose{}, random);
    }
  }
  const std::size_t first_wrong = scene.loops.size();
  const Pose aside = yaw_pose(0.0, {0.0, 30.0, 0.0});
  for (std::size_t k = 0; k < 40; k += 6) loop(scene, {kSessions - 1, k}, {0, k}, aside, random);
  const Alignment alignment = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  CHECK(alignment.connected == std::vector<bool>(kSessions, true));
  for (std::size_t s = 1; s < kSessions; ++s) {
    for (const std::size_t k : {0, 20, 39}) {
      const Pose apart =
          alignment.T_map_keyframe({0, k}).inverse() * alignment.T_map_keyframe({s, k});
      CHECK(apart.translation.norm() < 1.0);
    }
  }
  for (std::size_t i = 0; i < first_wrong; ++i) {
    const LoopDecision& decision = alignment.decisions[i];
    CHECK((decision.accepted ||
           decision.reason == "outside the consistency set of its two sessions"));
  }
  for (std::size_t i = first_wrong; i < scene.loops.size(); ++i) {
    CHECK(alignment.decisions[i].reason == "contradicts the maps merged before");
  }
}
