// Decisions of alignment and of its refinement at their thresholds
#include "tests/merge/alignment_scene.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

constexpr const char* kDisagrees = "disagrees with the merged maps";
constexpr const char* kContradicts = "contradicts the maps merged before";
constexpr const char* kDeforms = "the maps would deform more than odometry allows";

/// Two sessions of 40 keyframes with so many right loops, and wrong ones aside of the given
/// keyframe. The mean of the wrong ones is right: the start is not led astray by them.
Scene with_wrong_loops(std::size_t right, std::size_t step, std::size_t at,
                       std::initializer_list<double> aside_m) {
  Scene scene = beside_each_other({40, 40});
  connect_side_by_side(scene.loops, 1, 0, right * step, step);
  for (const double aside : aside_m) {
    scene.loops.push_back(exact_loop({1, at}, {0, at}, shifted(0.0, aside)));
  }
  return scene;
}

}  // namespace

TEST_CASE("A loop is rejected beyond the threshold of chi square after optimisation",
          "[alignment]") {
  Random random(15);
  Scene scene = two_maps(random);
  add_true_loops(scene, 12, random);
  MergeConfig config = loose_config();
  const Alignment all = align(scene, config);
  const auto count = [](const Alignment& alignment) {
    return std::count_if(alignment.decisions.begin(), alignment.decisions.end(),
                         [](const LoopDecision& decision) { return decision.accepted; });
  };
  REQUIRE(count(all) == 12);
  const std::size_t worst = worst_loop(all, scene);
  const double chi2 = chi2_after(all, scene.loops[worst]);
  REQUIRE(chi2 > 1.0);
  config.acceptance.loop_chi2 = 1.01 * chi2;
  CHECK(count(align(scene, config)) == 12);
  config.acceptance.loop_chi2 = 0.99 * chi2;
  const Alignment without = align(scene, config);
  CHECK(without.connected[1]);
  CHECK_FALSE(without.decisions[worst].accepted);
  CHECK(without.decisions[worst].reason == kDisagrees);
}

TEST_CASE("Maps are joined only if none deforms more than its odometry allows", "[alignment]") {
  // The second robot's odometry is too long by a given share.
  const auto joined = [](double scale_error) {
    Scene scene = beside_each_other({40, 40});
    for (Pose& pose : scene.sessions[1].T_odometry_keyframe) {
      pose.translation.x() *= 1.0 + scale_error;
    }
    connect_side_by_side(scene.loops, 1, 0, 40);
    MergeConfig config = loose_config();
    config.graph.cauchy_scale = 1000.0;  // every loop pulls as hard as it can
    config.graph.deformation_floor_m = 0.0;
    return align(scene, config);
  };
  CHECK(joined(0.001).connected[1]);
  const Alignment deformed = joined(0.1);
  CHECK_FALSE(deformed.connected[1]);
  CHECK(deformed.reason[1] == kDeforms);
}

TEST_CASE("Two maps are joined only if nine tenths of the earlier loops survive", "[alignment]") {
  // The second map is tied so strongly to the first that loops which contradict it give way.
  const auto joined = [](std::size_t contradicted) {
    Scene scene = beside_each_other({41});
    scene.sessions.push_back({contradict_ten_loops(scene, contradicted), 0.5});
    for (std::size_t k = 0; k < 41; ++k) {
      scene.loops.push_back(exact_loop({1, k}, {0, k}, Pose{}, 0.001));
    }
    return align(scene, pulling_config());
  };
  const Alignment one_gone = joined(1);
  CHECK(one_gone.connected[1]);
  CHECK(one_gone.decisions[0].reason == kDisagrees);
  for (std::size_t i = 0; i < one_gone.decisions.size(); ++i) {
    CHECK(one_gone.decisions[i].accepted == (i > 0));
  }
  const Alignment two_gone = joined(2);
  CHECK_FALSE(two_gone.connected[1]);
  CHECK(two_gone.reason[1] == kDeforms);
  // Rolled back: the earlier loops stay, and the first map is what it was.
  for (std::size_t i = 0; i < two_gone.decisions.size(); ++i) {
    CHECK(two_gone.decisions[i].accepted == (i < 10));
  }
  CHECK(apart_m(two_gone.T_map_keyframe({0, 40}), straight(41)[40]) < 1e-3);
}

TEST_CASE("Two maps are joined if half of their loops survive, with fewer they are not",
          "[alignment]") {
  const auto joined = [](std::size_t right) {
    MergeConfig config;
    config.acceptance.consistency_chi2 = 1e9;
    return align(with_wrong_loops(right, 4, 20, {30.0, -30.0, 60.0, -60.0, 90.0, -90.0}), config);
  };
  const Alignment half = joined(6);
  CHECK(half.connected[1]);
  for (std::size_t i = 0; i < half.decisions.size(); ++i) {
    CHECK(half.decisions[i].accepted == (i < 6));
    CHECK(half.decisions[i].reason == (i < 6 ? "" : kDisagrees));
  }
  const Alignment fewer = joined(5);
  CHECK_FALSE(fewer.connected[1]);
  CHECK(fewer.reason[1] == kContradicts);
  for (const LoopDecision& decision : fewer.decisions) {
    CHECK_FALSE(decision.accepted);
    CHECK(decision.reason == kContradicts);
  }
}

TEST_CASE("Two maps are joined only if enough of their loops survive", "[alignment]") {
  const auto joined = [](std::uint32_t min_strong_loops) {
    MergeConfig config;
    config.acceptance.consistency_chi2 = 1e9;
    config.acceptance.min_strong_loops = min_strong_loops;
    return align(with_wrong_loops(4, 8, 12, {30.0, -30.0}), config);
  };
  CHECK(joined(4).connected[1]);
  const Alignment refused = joined(5);
  CHECK_FALSE(refused.connected[1]);
  CHECK(refused.reason[1] == kContradicts);
}

TEST_CASE("Loops within a session are refused if they deform it implausibly", "[alignment]") {
  Scene scene = beside_each_other({40});
  for (const std::size_t k : {0U, 2U}) {
    scene.loops.push_back(exact_loop({0, 37 + k}, {0, k}, shifted(185.0, 60.0), 0.001));
  }
  MergeConfig config = pulling_config();
  config.acceptance.loop_chi2 = 1e9;
  const Alignment bent = align(scene, config);
  CHECK(bent.decisions[0].accepted);
  CHECK(bent.decisions[0].reason.empty());
  CHECK(bent.T_session_keyframe[0][39].translation.y() > 50.0);
  config.graph.deformation_floor_m = 0.0;
  const Alignment kept = align(scene, config);
  CHECK_FALSE(kept.decisions[0].accepted);
  CHECK(kept.decisions[0].reason == "disagrees with odometry or with the session's other loops");
  CHECK(kept.T_session_keyframe[0][39].translation == straight(40)[39].translation);
}

namespace {

Alignment refined(const Alignment& start, const Scene& scene, const MergeConfig& config = {}) {
  return refine_alignment(start, scene.sessions, scene.loops, config);
}

/// Two maps whose twelve loops are all accepted, and the one of these that agrees least.
struct TwelveLoops {
  Scene scene;
  MergeConfig config = loose_config();
  Alignment start;
  std::size_t worst = 0;

  TwelveLoops() {
    Random random(15);
    scene = two_maps(random);
    add_true_loops(scene, 12, random);
    start = align(scene, config);
    worst = worst_loop(start, scene);
    REQUIRE(start.decisions[worst].accepted);
  }
};

}  // namespace

TEST_CASE("Refinement adds radius loops and drops those that disagree", "[alignment]") {
  Random random(13);
  Scene scene = two_maps(random);
  add_true_loops(scene, 6, random);
  const Alignment coarse = align(scene);
  REQUIRE(coarse.connected[1]);
  add_true_loops(scene, 40, random);
  const std::size_t m = nearest(scene.truth[0], scene.truth[1][40]);
  loop(scene, {1, 40}, {0, m}, yaw_pose(0.1, {6.0, 0.0, 0.0}), random);
  const Alignment fine = refined(coarse, scene);
  CHECK(overlap_error_m(scene, fine) < overlap_error_m(scene, coarse));
  CHECK(overlap_error_m(scene, fine) < 0.35);
  CHECK_FALSE(fine.decisions.back().accepted);
  CHECK(fine.decisions.back().reason == kDisagrees);
}

TEST_CASE("Refinement readmits a loop whose chi square is below half the threshold",
          "[alignment]") {
  auto [scene, config, start, worst] = TwelveLoops();
  // What the maps are without this loop, and how well it agrees with them.
  start.decisions[worst] = {false, "refused before"};
  const auto at = static_cast<std::ptrdiff_t>(worst);
  Scene others = scene;
  others.loops.erase(others.loops.begin() + at);
  Alignment fewer = start;
  fewer.decisions.erase(fewer.decisions.begin() + at);
  const double chi2 = chi2_after(refined(fewer, others, config), scene.loops[worst]);
  config.acceptance.loop_chi2 = 2.0 * chi2 * 1.02;
  CHECK(refined(start, scene, config).decisions[worst].accepted);
  config.acceptance.loop_chi2 = 2.0 * chi2 * 0.98;
  const LoopDecision refused = refined(start, scene, config).decisions[worst];
  CHECK_FALSE(refused.accepted);
  CHECK(refused.reason == "refused before");
}

TEST_CASE("A loop accepted before that refinement rejects is accepted no longer", "[alignment]") {
  auto [scene, config, start, worst] = TwelveLoops();
  config.acceptance.loop_chi2 = 0.99 * chi2_after(start, scene.loops[worst]);
  const LoopDecision refused = refined(start, scene, config).decisions[worst];
  CHECK_FALSE(refused.accepted);
  CHECK(refused.reason == kDisagrees);
}

TEST_CASE("Refinement keeps the start if the maps would deform implausibly", "[alignment]") {
  Scene scene = beside_each_other({40, 40});
  connect_side_by_side(scene.loops, 1, 0, 40);
  MergeConfig config;
  const Alignment start = align(scene, config);
  REQUIRE(start.connected[1]);
  const std::size_t earlier = scene.loops.size();
  CHECK_THROWS_WITH(
      refine_alignment(start, scene.sessions, std::span(scene.loops).first(earlier - 1), config),
      "refinement needs all earlier loops");
  // The end of the second map is pulled far aside, by loops that outweigh the others.
  for (std::size_t k = 31; k < 40; k += 2) {
    scene.loops.push_back(exact_loop({1, k}, {0, k}, shifted(0.0, 40.0), 0.01 * kLoopSigmaM));
  }
  config.acceptance.loop_chi2 = 1e9;
  config.graph.cauchy_scale = 1e6;
  config.graph.deformation_floor_m = 0.001;
  const Alignment kept = refined(start, scene, config);
  for (std::size_t i = 0; i < kept.decisions.size(); ++i) {
    CHECK(kept.decisions[i].accepted == (i < earlier));
    if (i >= earlier) {
      CHECK(kept.decisions[i].reason == "the maps would deform more than odometry allows");
    }
  }
  CHECK(kept.T_map_keyframe({1, 39}).translation == start.T_map_keyframe({1, 39}).translation);
  config.graph.deformation_floor_m = 1000.0;
  const Alignment pulled = refined(start, scene, config);
  for (const LoopDecision& decision : pulled.decisions) CHECK(decision.accepted);
  CHECK(apart_m(pulled.T_map_keyframe({1, 39}), start.T_map_keyframe({1, 39})) > 10.0);
}

TEST_CASE("Refinement leaves the loops of a session alone that is not connected", "[alignment]") {
  Scene scene = beside_each_other({40, 40, 30});
  connect_side_by_side(scene.loops, 1, 0, 40);
  for (const std::size_t k : {0U, 4U}) {
    scene.loops.push_back(exact_loop({2, 25 + k}, {2, 5 + k}, shifted(20.0 * kStepM)));
  }
  const Alignment start = align(scene);
  REQUIRE(start.decisions.back().accepted);
  REQUIRE_FALSE(start.connected[2]);
  const Alignment after = refined(start, scene);
  CHECK(after.decisions.back().accepted);
  CHECK_FALSE(after.connected[2]);
  CHECK(after.reason[2] == start.reason[2]);
}

TEST_CASE("Refinement lets a loop within a session wait that nothing confirms", "[alignment]") {
  // The first session comes back to where it was; radius search finds loops 1.4 m aside.
  const auto last_decision = [](const std::vector<std::size_t>& queries) {
    std::vector<Pose> back = straight(20);
    for (std::size_t i = 20; i-- > 0;) {
      back.push_back(yaw_pose(3.14159, straight(20)[i].translation));
    }
    Scene scene;
    scene.sessions = {{back, 2.0}, {straight(20), 1.0}};
    connect_side_by_side(scene.loops, 1, 0, 20);
    const Alignment start = align(scene, {}, [](const Placement&) {
      return PlacementEvidence{9, 0, {}};
    });
    REQUIRE(start.connected[1]);
    for (const std::size_t q : queries) {
      scene.loops.push_back(exact_loop({0, q}, {0, 39 - q}, yaw_pose(3.14159, {0.0, 1.4, 0.0})));
    }
    return refined(start, scene).decisions.back();
  };
  const LoopDecision one = last_decision({39});
  CHECK_FALSE(one.accepted);
  CHECK(one.reason == "waits for another loop of the session that confirms it");
  const LoopDecision two = last_decision({35, 38});
  INFO(two.reason);
  CHECK(two.accepted);
}
