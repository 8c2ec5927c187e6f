// Refinement of an alignment with radius loops.
#include <catch2/catch.hpp>
#include <span>

#include "tests/merge/alignment_scene.hpp"
#include "unimapper/merge/alignment.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

TEST_CASE("Refinement adds radius loops and drops those that disagree", "[alignment]") {
  Random random(13);
  Scene scene = two_maps(random);
  add_true_loops(scene, 6, random);
  const Alignment coarse = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(coarse.connected[1]);
  add_true_loops(scene, 40, random);
  const KeyframeId wrong{1, 40};
  const std::size_t m = nearest(scene.truth[0], scene.truth[1][40]);
  loop(scene, wrong, {0, m}, yaw_pose(0.1, {6.0, 0.0, 0.0}), random);
  const Alignment fine = refine_alignment(coarse, scene.sessions, scene.loops, MergeConfig{});
  CHECK(overlap_error_m(scene, fine) < overlap_error_m(scene, coarse));
  CHECK(overlap_error_m(scene, fine) < 0.35);
  CHECK_FALSE(fine.decisions.back().accepted);
  CHECK(fine.decisions.back().reason == "disagrees with the merged maps");
}

TEST_CASE("Refinement readmits a loop whose chi square is below half the threshold",
          "[alignment]") {
  Random random(15);
  Scene scene = two_maps(random);
  add_true_loops(scene, 12, random);
  MergeConfig config = loose_config();
  Alignment start = align_sessions(scene.sessions, scene.loops, config);
  const std::size_t worst = worst_loop(start, scene);
  // What the maps are without this loop, and how well it agrees with them.
  start.decisions[worst] = {false, "refused before"};
  std::vector<LoopConstraint> others = scene.loops;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(worst));
  Alignment fewer = start;
  fewer.decisions.erase(fewer.decisions.begin() + static_cast<std::ptrdiff_t>(worst));
  const Alignment without = refine_alignment(fewer, scene.sessions, others, config);
  const double chi2 = chi2_after(without, scene.loops[worst]);
  config.acceptance.loop_chi2 = 2.0 * chi2 * 1.02;
  CHECK(refine_alignment(start, scene.sessions, scene.loops, config).decisions[worst].accepted);
  config.acceptance.loop_chi2 = 2.0 * chi2 * 0.98;
  const Alignment refused = refine_alignment(start, scene.sessions, scene.loops, config);
  CHECK_FALSE(refused.decisions[worst].accepted);
  CHECK(refused.decisions[worst].reason == "refused before");
}

TEST_CASE("A loop accepted before that refinement rejects is accepted no longer", "[alignment]") {
  Random random(15);
  Scene scene = two_maps(random);
  add_true_loops(scene, 12, random);
  MergeConfig config = loose_config();
  const Alignment start = align_sessions(scene.sessions, scene.loops, config);
  const std::size_t worst = worst_loop(start, scene);
  REQUIRE(start.decisions[worst].accepted);
  config.acceptance.loop_chi2 = 0.99 * chi2_after(start, scene.loops[worst]);
  const Alignment refined = refine_alignment(start, scene.sessions, scene.loops, config);
  CHECK_FALSE(refined.decisions[worst].accepted);
  CHECK(refined.decisions[worst].reason == "disagrees with the merged maps");
}

TEST_CASE("Refinement keeps the start if the maps would deform implausibly", "[alignment]") {
  Scene scene;
  scene.sessions = {{straight(40), 1.0}, {straight(40), 0.5}};
  connect_side_by_side(scene.loops, 1, 0, 40);
  MergeConfig config;
  const Alignment start = align_sessions(scene.sessions, scene.loops, config);
  REQUIRE(start.connected[1]);
  const std::size_t earlier = scene.loops.size();
  CHECK_THROWS_WITH(
      refine_alignment(start, scene.sessions, std::span(scene.loops).first(earlier - 1), config),
      "refinement needs all earlier loops");
  // The end of the second map is pulled far aside, by loops that outweigh the others.
  for (std::size_t k = 31; k < 40; k += 2) {
    scene.loops.push_back(
        exact_loop({1, k}, {0, k}, yaw_pose(0.0, {0.0, 40.0, 0.0}), 0.01 * kLoopSigmaM));
  }
  config.acceptance.loop_chi2 = 1e9;
  config.graph.cauchy_scale = 1e6;
  config.graph.deformation_floor_m = 0.001;
  const Alignment kept = refine_alignment(start, scene.sessions, scene.loops, config);
  for (std::size_t i = 0; i < kept.decisions.size(); ++i) {
    CHECK(kept.decisions[i].accepted == (i < earlier));
    if (i >= earlier) {
      CHECK(kept.decisions[i].reason == "the maps would deform more than odometry allows");
    }
  }
  CHECK(kept.T_map_keyframe({1, 39}).translation == start.T_map_keyframe({1, 39}).translation);
  config.graph.deformation_floor_m = 1000.0;
  const Alignment pulled = refine_alignment(start, scene.sessions, scene.loops, config);
  for (const LoopDecision& decision : pulled.decisions) CHECK(decision.accepted);
  CHECK((pulled.T_map_keyframe({1, 39}).translation - start.T_map_keyframe({1, 39}).translation)
            .norm() > 10.0);
}

TEST_CASE("Refinement leaves the loops of a session alone that is not connected", "[alignment]") {
  Scene scene;
  scene.sessions = {{straight(40), 2.0}, {straight(40), 1.0}, {straight(30), 0.5}};
  connect_side_by_side(scene.loops, 1, 0, 40);
  Pose ahead;
  ahead.translation.x() = 20.0 * kStepM;
  for (const std::size_t k : {0U, 4U}) {
    scene.loops.push_back(exact_loop({2, 25 + k}, {2, 5 + k}, ahead));
  }
  const Alignment start = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(start.decisions.back().accepted);
  REQUIRE_FALSE(start.connected[2]);
  const Alignment refined = refine_alignment(start, scene.sessions, scene.loops, MergeConfig{});
  CHECK(refined.decisions.back().accepted);
  CHECK_FALSE(refined.connected[2]);
  CHECK(refined.reason[2] == start.reason[2]);
}

TEST_CASE("Refinement lets a loop within a session wait that nothing confirms", "[alignment]") {
  // The first session comes back to where it was; radius search finds loops 1.4 m aside.
  const auto refined = [](const std::vector<std::size_t>& queries) {
    Scene scene;
    std::vector<Pose> back = straight(20);
    for (std::size_t i = 20; i-- > 0;)
      back.push_back(yaw_pose(3.14159, straight(20)[i].translation));
    scene.sessions = {{back, 2.0}, {straight(20), 1.0}};
    connect_side_by_side(scene.loops, 1, 0, 20);
    const Alignment start =
        align_sessions(scene.sessions, scene.loops, MergeConfig{}, [](const Placement&) {
          return PlacementEvidence{9, 0, {}};
        });
    REQUIRE(start.connected[1]);
    for (const std::size_t q : queries) {
      scene.loops.push_back(exact_loop({0, q}, {0, 39 - q}, yaw_pose(3.14159, {0.0, 1.4, 0.0})));
    }
    return refine_alignment(start, scene.sessions, scene.loops, MergeConfig{});
  };
  const Alignment one = refined({39});
  CHECK_FALSE(one.decisions.back().accepted);
  CHECK(one.decisions.back().reason == "waits for another loop of the session that confirms it");
  const Alignment two = refined({35, 38});
  INFO(two.decisions.back().reason);
  CHECK(two.decisions.back().accepted);
}
