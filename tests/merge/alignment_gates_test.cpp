// Decisions of alignment at their thresholds: chi square, survivors, deformation.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/merge/alignment_scene.hpp"
#include "unimapper/merge/alignment.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

TEST_CASE("A loop is rejected beyond the threshold of chi square after optimisation",
          "[alignment]") {
  Random random(15);
  Scene scene = two_maps(random);
  add_true_loops(scene, 12, random);
  MergeConfig config = loose_config();
  const Alignment all = align_sessions(scene.sessions, scene.loops, config);
  const auto count = [](const Alignment& alignment) {
    return std::count_if(alignment.decisions.begin(), alignment.decisions.end(),
                         [](const LoopDecision& decision) { return decision.accepted; });
  };
  REQUIRE(count(all) == 12);
  const std::size_t worst = worst_loop(all, scene);
  const double chi2 = chi2_after(all, scene.loops[worst]);
  REQUIRE(chi2 > 1.0);
  config.acceptance.loop_chi2 = 1.01 * chi2;
  CHECK(count(align_sessions(scene.sessions, scene.loops, config)) == 12);
  config.acceptance.loop_chi2 = 0.99 * chi2;
  const Alignment without = align_sessions(scene.sessions, scene.loops, config);
  CHECK(without.connected[1]);
  CHECK_FALSE(without.decisions[worst].accepted);
  CHECK(without.decisions[worst].reason == "disagrees with the merged maps");
}

TEST_CASE("Maps are joined only if none deforms more than its odometry allows", "[alignment]") {
  // The second robot's odometry is too long by a given share.
  const auto joined = [](double scale_error) {
    Scene scene;
    std::vector<Pose> scaled = straight(40);
    for (Pose& pose : scaled) pose.translation.x() *= 1.0 + scale_error;
    scene.truth = {straight(40), straight(40)};
    scene.sessions = {{straight(40), 1.0}, {scaled, 0.5}};
    for (std::size_t k = 0; k < 40; k += 2) {
      LoopConstraint l;
      l.query = {1, k};
      l.match = {0, k};
      l.information = Matrix6d::Identity() / (kLoopSigmaM * kLoopSigmaM);
      l.overlap = 0.9;
      scene.loops.push_back(l);
    }
    MergeConfig config = loose_config();
    config.graph.cauchy_scale = 1000.0;  // every loop pulls as hard as it can
    config.graph.deformation_floor_m = 0.0;
    return align_sessions(scene.sessions, scene.loops, config);
  };
  CHECK(joined(0.001).connected[1]);
  const Alignment deformed = joined(0.1);
  CHECK_FALSE(deformed.connected[1]);
  CHECK(deformed.reason[1] == "the maps would deform more than odometry allows");
}

TEST_CASE("Two maps are not joined if most of their loops do not survive the solve",
          "[alignment]") {
  Random random(16);
  Scene scene = two_maps(random);
  add_true_loops(scene, 10, random);
  MergeConfig config = loose_config();
  const Alignment all = align_sessions(scene.sessions, scene.loops, config);
  REQUIRE(all.connected[1]);
  std::vector<double> chi2;
  for (const auto& l : scene.loops) chi2.push_back(chi2_after(all, l));
  std::sort(chi2.begin(), chi2.end());
  // Three of ten stay: enough for two strong ones, but fewer than half.
  config.acceptance.loop_chi2 = 0.5 * (chi2[2] + chi2[3]);
  const Alignment few = align_sessions(scene.sessions, scene.loops, config);
  CHECK_FALSE(few.connected[1]);
  CHECK(few.reason[1] == "contradicts the maps merged before");
}

TEST_CASE("Two maps are joined only if nine tenths of the earlier loops survive", "[alignment]") {
  // Ten loops along the first map, each over two steps. The second map is longer by ten metres
  // where some of them are, and tied so strongly to the first that these loops must give way.
  const auto joined = [](std::size_t contradicted) {
    Scene scene;
    std::vector<Pose> longer = straight(41);
    for (std::size_t k = 1; k < longer.size(); ++k) {
      const bool stretched = (k - 1) / 4 < contradicted && (k - 1) % 4 < 2;
      longer[k].translation.x() =
          longer[k - 1].translation.x() + (stretched ? 2.0 * kStepM : kStepM);
    }
    scene.sessions = {{straight(41), 1.0}, {longer, 0.5}};
    for (std::size_t j = 0; j < 10; ++j) {
      Pose two_steps;
      two_steps.translation.x() = 2.0 * kStepM;
      scene.loops.push_back(exact_loop({0, 4 * j + 2}, {0, 4 * j}, two_steps));
    }
    for (std::size_t k = 0; k < 41; ++k) {
      scene.loops.push_back(exact_loop({1, k}, {0, k}, Pose{}, 0.001));
    }
    MergeConfig config;
    config.acceptance.consistency_chi2 = 1e9;
    config.graph.cauchy_scale = 1e6;
    config.graph.deformation_floor_m = 1000.0;
    return align_sessions(scene.sessions, scene.loops, config);
  };
  const Alignment one_gone = joined(1);
  CHECK(one_gone.connected[1]);
  CHECK_FALSE(one_gone.decisions[0].accepted);
  CHECK(one_gone.decisions[0].reason == "disagrees with the merged maps");
  for (std::size_t i = 1; i < one_gone.decisions.size(); ++i) {
    CHECK(one_gone.decisions[i].accepted);
  }
  const Alignment two_gone = joined(2);
  CHECK_FALSE(two_gone.connected[1]);
  CHECK(two_gone.reason[1] == "the maps would deform more than odometry allows");
  // Rolled back: the earlier loops stay, and the first map is what it was.
  for (std::size_t i = 0; i < two_gone.decisions.size(); ++i) {
    CHECK(two_gone.decisions[i].accepted == (i < 10));
  }
  CHECK((two_gone.T_map_keyframe({0, 40}).translation - straight(41)[40].translation).norm() <
        1e-3);
}

TEST_CASE("Two maps are joined if half of their loops survive, with fewer they are not",
          "[alignment]") {
  const auto joined = [](std::size_t right) {
    Scene scene;
    scene.sessions = {{straight(40), 1.0}, {straight(40), 0.5}};
    for (std::size_t i = 0; i < right; ++i) {
      scene.loops.push_back(exact_loop({1, 4 * i}, {0, 4 * i}, Pose{}));
    }
    // Six wrong ones, whose mean is right: the start is not led astray by them.
    for (const double aside : {30.0, -30.0, 60.0, -60.0, 90.0, -90.0}) {
      scene.loops.push_back(exact_loop({1, 20}, {0, 20}, yaw_pose(0.0, {0.0, aside, 0.0})));
    }
    MergeConfig config;
    config.acceptance.consistency_chi2 = 1e9;
    return align_sessions(scene.sessions, scene.loops, config);
  };
  const Alignment half = joined(6);
  CHECK(half.connected[1]);
  for (std::size_t i = 0; i < half.decisions.size(); ++i) {
    CHECK(half.decisions[i].accepted == (i < 6));
    CHECK(half.decisions[i].reason == (i < 6 ? "" : "disagrees with the merged maps"));
  }
  const Alignment fewer = joined(5);
  CHECK_FALSE(fewer.connected[1]);
  CHECK(fewer.reason[1] == "contradicts the maps merged before");
  for (const LoopDecision& decision : fewer.decisions) {
    CHECK_FALSE(decision.accepted);
    CHECK(decision.reason == "contradicts the maps merged before");
  }
}

TEST_CASE("Two maps are joined only if enough of their loops survive", "[alignment]") {
  // Four right ones, and two wrong ones on either side.
  const auto joined = [](std::uint32_t min_strong_loops) {
    Scene scene;
    scene.sessions = {{straight(40), 1.0}, {straight(40), 0.5}};
    for (std::size_t i = 0; i < 4; ++i) {
      scene.loops.push_back(exact_loop({1, 8 * i}, {0, 8 * i}, Pose{}));
    }
    for (const double aside : {30.0, -30.0}) {
      scene.loops.push_back(exact_loop({1, 12}, {0, 12}, yaw_pose(0.0, {0.0, aside, 0.0})));
    }
    MergeConfig config;
    config.acceptance.consistency_chi2 = 1e9;
    config.acceptance.min_strong_loops = min_strong_loops;
    return align_sessions(scene.sessions, scene.loops, config);
  };
  CHECK(joined(4).connected[1]);
  const Alignment refused = joined(5);
  CHECK_FALSE(refused.connected[1]);
  CHECK(refused.reason[1] == "contradicts the maps merged before");
}

TEST_CASE("Loops within a session are refused if they deform it implausibly", "[alignment]") {
  // Forty keyframes straight ahead that two loops bend by sixty metres.
  Scene scene;
  scene.sessions = {{straight(40), 1.0}};
  for (const std::size_t k : {0U, 2U}) {
    scene.loops.push_back(
        exact_loop({0, 37 + k}, {0, k}, yaw_pose(0.0, {185.0, 60.0, 0.0}), 0.001));
  }
  MergeConfig config;
  config.acceptance.consistency_chi2 = 1e9;
  config.acceptance.loop_chi2 = 1e9;
  config.graph.cauchy_scale = 1e6;
  config.graph.deformation_floor_m = 1000.0;
  const Alignment bent = align_sessions(scene.sessions, scene.loops, config);
  CHECK(bent.decisions[0].accepted);
  CHECK(bent.decisions[0].reason.empty());
  CHECK(bent.T_session_keyframe[0][39].translation.y() > 50.0);
  config.graph.deformation_floor_m = 0.0;
  const Alignment kept = align_sessions(scene.sessions, scene.loops, config);
  CHECK_FALSE(kept.decisions[0].accepted);
  CHECK(kept.decisions[0].reason == "disagrees with odometry or with the session's other loops");
  CHECK(kept.T_session_keyframe[0][39].translation == straight(40)[39].translation);
}
