// Alignment under outliers, its centre, start and order
#include "unimapper/merge/alignment.hpp"

#include "tests/merge/alignment_scene.hpp"
#include "tests/test.hpp"

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
    add_true_loops(scene, true_loops, random);
    add_random_loops(scene, random_loops, random);
    if (aliased_loops > 0) add_aliased_loops(scene, aliased_loops, random);
    const Alignment alignment = align(scene);
    if (!alignment.connected[0] || !alignment.connected[1]) {
      ++tally.refused;
      CHECK(alignment.T_session_keyframe[1].size() == 160);
      CHECK_FALSE(alignment.reason[1].empty());
      for (const LoopDecision& decision : alignment.decisions) {
        CHECK_FALSE(decision.accepted);
        CHECK_FALSE(decision.reason.empty());
      }
    } else {
      ++(overlap_error_m(scene, alignment) < 1.5 ? tally.right : tally.wrong);
    }
  }
  return tally;
}

}  // namespace

TEST_CASE("True loops win over thrice as many random ones, which alone merge nothing",
          "[alignment]") {
  CHECK(trials(10, 0, 0).right == 15);
  CHECK(trials(10, 30, 0).right == 15);
  CHECK(trials(5, 20, 0).wrong == 0);
  CHECK(trials(0, 15, 0).refused == 15);
  CHECK(trials(0, 60, 0).refused == 15);
}

TEST_CASE("Perceptual aliasing leads to a refusal, not to a wrong map", "[alignment]") {
  CHECK(trials(10, 0, 12).refused == 15);
  CHECK(trials(10, 0, 6).wrong == 0);
  CHECK(trials(0, 0, 2).refused == 15);
}

TEST_CASE("Intra-session loops correct drift, a false one does not deform the map", "[alignment]") {
  Random random(12);
  std::vector<Pose> truth;
  // Twice around a block of 100 m by 100 m.
  for (int i = 0; i < 160; ++i) {
    const int side = i / 20 % 4;
    const double along = 5.0 * (i % 20);
    const Eigen::Vector3d corners[] = {{0, 0, 0}, {100, 0, 0}, {100, 100, 0}, {0, 100, 0}};
    truth.push_back(yaw_pose(1.5708 * side, corners[side]) * shifted(along));
  }
  Scene scene;
  scene.truth = {truth};
  scene.sessions.push_back({odometry(random, truth), 1.0});
  for (std::size_t i = 0; i < 16; ++i) loop(scene, {0, 80 + 5 * i}, {0, 5 * i}, Pose{}, random);
  loop(scene, {0, 150}, {0, 20}, Pose{}, random);  // the far corner, taken for this one
  const Alignment alignment = align(scene);
  CHECK(alignment.connected[0]);
  CHECK_FALSE(alignment.decisions.back().accepted);
  CHECK(alignment.decisions.back().reason ==
        "disagrees with odometry or with the session's other loops");
  std::size_t accepted = 0;
  for (const auto& decision : alignment.decisions) accepted += decision.accepted ? 1 : 0;
  CHECK(accepted >= 14);
  CHECK(apart_m(alignment, {0, 155}, {0, 75}) < 0.5);
}

TEST_CASE("A loop between keyframes that are not there, or of one to itself, is refused",
          "[alignment]") {
  Scene scene = beside_each_other({5});
  const auto query = [&](const KeyframeId& keyframe) {
    scene.loops = {exact_loop(keyframe, {0, 2})};
    return align(scene);
  };
  CHECK_THROWS_WITH(query({0, 2}), "loop of a keyframe to itself");
  CHECK_THROWS_WITH(query({0, 5}), "loop between keyframes that do not exist");
  CHECK_THROWS_WITH(query({1, 0}), "loop between keyframes that do not exist");
  CHECK_NOTHROW(query({0, 4}));
}

TEST_CASE("The central session is the best of those that most keyframes are connected to",
          "[alignment]") {
  // Two connected sessions of 40 keyframes, and one apart that has the best score.
  const auto with_apart = [](std::size_t keyframes_apart) {
    Scene scene;
    scene.sessions = {{straight(40), 1.0}, {straight(keyframes_apart), 9.0}, {straight(40), 2.0}};
    connect_side_by_side(scene.loops, 2, 0, 40);
    return align(scene);
  };
  const Alignment fewer = with_apart(79);
  CHECK(fewer.central == 2);
  CHECK(fewer.connected == std::vector<bool>{true, false, true});
  CHECK(fewer.reason[1] == "no loops found");
  CHECK(fewer.reason[0].empty());
  // As many: the score decides.
  const Alignment as_many = with_apart(80);
  CHECK(as_many.central == 1);
  CHECK(as_many.connected == std::vector<bool>{false, true, false});
}

TEST_CASE("A session that stays apart names the reason of its strongest pair", "[alignment]") {
  Scene scene = beside_each_other({40, 40, 40});
  connect_side_by_side(scene.loops, 1, 0, 40);
  const auto reason = [&] {
    const Alignment alignment = align(scene);
    REQUIRE(alignment.connected[1]);
    REQUIRE_FALSE(alignment.connected[2]);
    return alignment.reason[2];
  };
  CHECK(reason() == "no loops found");
  LoopConstraint weak = exact_loop({2, 20}, {1, 20});
  scene.loops.push_back(weak);
  CHECK(reason() == "too few consistent loops: 1 of 1");
  // Two of them are more, if they do not overlap strongly.
  weak = exact_loop({2, 10}, {0, 10});
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
    Scene scene = beside_each_other({40, 40, 40});
    for (std::size_t s = 0; s < 3; ++s) {
      for (Pose& pose : scene.sessions[s].T_odometry_keyframe) pose = frames[s] * pose;
    }
    scene.sessions[chain[0]].central_score = 2.0;
    connect_side_by_side(scene.loops, chain[1], chain[0], 40);
    connect_side_by_side(scene.loops, chain[2], chain[1], 40);
    MergeConfig config;
    config.graph.max_iterations = 1;
    const Alignment alignment = align(scene, config);
    REQUIRE(alignment.central == chain[0]);
    CHECK(alignment.T_map_session[chain[0]].translation.norm() == 0.0);
    REQUIRE(alignment.connected == std::vector<bool>{true, true, true});
    for (std::size_t s = 0; s < 3; ++s) {
      for (const std::size_t k : {0U, 39U}) {
        CHECK(apart_m(alignment, {s, k}, {chain[0], k}) < 1e-3);
      }
    }
  } while (std::next_permutation(chain.begin(), chain.end()));
}

TEST_CASE("Of two pairs that contradict each other the one with more distinct loops is joined",
          "[alignment]") {
  // The third session lies beside the second and aside of the first, which lie beside each other.
  const auto y_of_third = [](std::size_t with_first, std::size_t with_second) {
    Scene scene = beside_each_other({60, 60, 60});
    connect_side_by_side(scene.loops, 1, 0, 60);
    for (std::size_t i = 0; i < with_first; ++i) {
      scene.loops.push_back(exact_loop({2, 5 * i}, {0, 5 * i}, shifted(0.0, 40.0)));
    }
    connect_side_by_side(scene.loops, 2, 1, 5 * with_second, 5);
    const Alignment alignment = align(scene);
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
  CHECK(y_of_third(8, 9) == Approx(0.0).margin(1e-3));
  CHECK(y_of_third(9, 8) == Approx(40.0).margin(1e-3));
}

TEST_CASE("Pairs that close a cycle of sessions are joined after those that connect one",
          "[alignment]") {
  // Ten loops along the first half of the central session, six of which must give way to the
  // second session, which is longer there. Two more sessions lie beside the second half, and the
  // pair of them is stronger than that of the second session. Had it come first, its loops would
  // make the six less than a tenth of the earlier ones.
  constexpr std::size_t kHalf = 41;
  Scene scene;
  const std::vector<Pose> longer = contradict_ten_loops(scene, 6);
  scene.sessions = {
      {straight(kHalf + 50), 9.0}, {longer, 0.5}, {straight(50), 0.4}, {straight(50), 0.3}};
  const std::size_t intra = scene.loops.size();
  for (std::size_t k = 0; k < 26; k += 2) {
    scene.loops.push_back(exact_loop({1, k}, {0, k}, Pose{}, 0.001));
  }
  const std::size_t contradicting = scene.loops.size();
  for (const std::size_t session : {2U, 3U}) {
    for (std::size_t k = 0; k < 46; k += 2) {
      scene.loops.push_back(exact_loop({session, k}, {0, kHalf + k}));
    }
  }
  connect_side_by_side(scene.loops, 3, 2, 40);
  const Alignment alignment = align(scene, pulling_config());
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
    scene.sessions.push_back({odometry(random, street), 1.0});
  }
  for (std::size_t s = 0; s < kSessions; ++s) {
    for (std::size_t next = s + 1; next < std::min(s + 3, kSessions); ++next) {
      for (std::size_t k = 0; k < 40; k += 3) loop(scene, {next, k}, {s, k}, Pose{}, random);
    }
  }
  const std::size_t first_wrong = scene.loops.size();
  for (std::size_t k = 0; k < 40; k += 6) {
    loop(scene, {kSessions - 1, k}, {0, k}, shifted(0.0, 30.0), random);
  }
  const Alignment alignment = align(scene);
  CHECK(alignment.connected == std::vector<bool>(kSessions, true));
  for (std::size_t s = 1; s < kSessions; ++s) {
    for (const std::size_t k : {0, 20, 39}) CHECK(apart_m(alignment, {0, k}, {s, k}) < 1.0);
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

TEST_CASE("A stretch on which odometry slipped is corrected by the loops if it is told") {
  constexpr std::size_t kCount = 40;
  constexpr std::size_t kSlipped = 20;
  for (const bool is_told : {false, true}) {
    Scene scene = beside_each_other({kCount, kCount});
    AlignmentSession& slipped = scene.sessions[1];
    for (std::size_t k = kSlipped; k < kCount; ++k) {
      slipped.T_odometry_keyframe[k].translation.x() += 5.0;
    }
    slipped.slips.assign(kCount, SlipCovariance::Zero());
    if (is_told) slipped.slips[kSlipped](0, 0) = 25.0F;
    connect_side_by_side(scene.loops, 1, 0, kCount);
    const Alignment alignment = align(scene);
    CHECK(alignment.connected[1] == is_told);
    if (is_told) CHECK(apart_m(alignment, {0, kCount - 1}, {1, kCount - 1}) < 0.05);
  }
}
