// Alignment under outliers: random false loops and perceptual aliasing.
#include "unimapper/merge/alignment.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "tests/merge/random.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Random;

namespace {

constexpr double kStepM = 5.0;
constexpr double kLoopSigmaM = 0.3;
constexpr double kLoopSigmaRad = 0.019;

Pose yaw_pose(double yaw, const Eigen::Vector3d& t) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), t};
}

/// A drive of `count` keyframes through town, 5 m apart, gentle bends and a turn now and then.
std::vector<Pose> drive(Random& random, std::size_t count, Pose pose) {
  std::vector<Pose> path;
  double turn_left = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    path.push_back(pose);
    if (i % 25 == 24) turn_left = random.uniform() < 0.5 ? -1.5708 : 1.5708;
    const double turn = std::clamp(turn_left, -0.4, 0.4);
    turn_left -= turn;
    pose = pose * yaw_pose(turn + 0.01 * random.normal(), {kStepM, 0.0, 0.0});
  }
  return path;
}

/// What odometry makes of true poses: drift 0.05 m and 0.11 degrees per 5 m, its own origin.
std::vector<Pose> odometry(Random& random, const std::vector<Pose>& truth) {
  std::vector<Pose> path{yaw_pose(random.uniform(-3.0, 3.0), random.normal3(100.0))};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    path.push_back(path.back() * truth[i - 1].inverse() * truth[i] * random.pose(0.05, 0.0019));
  }
  return path;
}

struct Scene {
  std::vector<std::vector<Pose>> truth;
  std::vector<AlignmentSession> sessions;
  std::vector<LoopConstraint> loops;
};

/// Central map of 1,500 m; the query shares 400 m of it and goes its own way for another 400 m.
Scene two_maps(Random& random) {
  Scene scene;
  const std::vector<Pose> central = drive(random, 300, Pose{});
  const std::size_t start = 60 + random.below(120);
  std::vector<Pose> query(central.begin() + static_cast<std::ptrdiff_t>(start),
                          central.begin() + static_cast<std::ptrdiff_t>(start + 80));
  const std::vector<Pose> own = drive(random, 81, query.back() * yaw_pose(1.5708, {0.0, 0.0, 0.0}));
  query.insert(query.end(), own.begin() + 1, own.end());
  for (auto& pose : query) pose = pose * yaw_pose(0.0, {0.0, 1.5, 0.0});
  scene.truth = {central, query};
  scene.sessions.push_back({odometry(random, central), 1.0});
  scene.sessions.push_back({odometry(random, query), 0.5});
  return scene;
}

LoopConstraint loop(Scene& scene, KeyframeId query, KeyframeId match, const Pose& T_match_query,
                    Random& random) {
  LoopConstraint l;
  l.query = query;
  l.match = match;
  l.T_match_query = T_match_query * random.pose(kLoopSigmaM, kLoopSigmaRad);
  l.information.setZero();
  l.information.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / (kLoopSigmaM * kLoopSigmaM));
  l.information.bottomRightCorner<3, 3>().diagonal().setConstant(1.0 /
                                                                 (kLoopSigmaRad * kLoopSigmaRad));
  l.overlap = 0.5;
  scene.loops.push_back(l);
  return l;
}

std::size_t nearest(const std::vector<Pose>& path, const Pose& pose) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    if ((path[i].translation - pose.translation).norm() <
        (path[best].translation - pose.translation).norm()) {
      best = i;
    }
  }
  return best;
}

void add_true_loops(Scene& scene, std::size_t count, Random& random) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t q = i * 80 / count + random.below(80 / count);
    const std::size_t m = nearest(scene.truth[0], scene.truth[1][q]);
    loop(scene, {1, q}, {0, m}, scene.truth[0][m].inverse() * scene.truth[1][q], random);
  }
}

void add_random_loops(Scene& scene, std::size_t count, Random& random) {
  for (std::size_t i = 0; i < count; ++i) {
    const Pose wrong = yaw_pose(random.uniform(-3.1, 3.1), random.normal3(2.0));
    loop(scene, {1, random.below(160)}, {0, random.below(300)}, wrong, random);
  }
}

/// Perceptual aliasing: a street that looks like another one gives consistent false loops along it.
void add_aliased_loops(Scene& scene, std::size_t count, Random& random) {
  const std::size_t q = 90 + random.below(40);
  const std::size_t m = 10 + random.below(250);
  const Pose T_map_query = scene.sessions[0].T_odometry_keyframe[m] *
                           yaw_pose(0.3, {1.0, 0.5, 0.0}) *
                           scene.sessions[1].T_odometry_keyframe[q].inverse();
  for (std::size_t i = 0; i < count; ++i) {
    const Pose seen = T_map_query * scene.sessions[1].T_odometry_keyframe[q + i];
    const std::size_t k = nearest(scene.sessions[0].T_odometry_keyframe, seen);
    // The keyframes need not be neighbours for the loops to agree with each other.
    loop(scene, {1, q + i}, {0, k}, scene.sessions[0].T_odometry_keyframe[k].inverse() * seen,
         random);
  }
}

/// RMS over the shared part of how far the query's keyframes are from where they belong,
/// relative to the central keyframes beside them.
double overlap_error_m(const Scene& scene, const Alignment& alignment) {
  double sum = 0.0;
  for (std::size_t q = 0; q < 80; ++q) {
    const std::size_t m = nearest(scene.truth[0], scene.truth[1][q]);
    const Pose truth = scene.truth[0][m].inverse() * scene.truth[1][q];
    const Pose estimate =
        alignment.T_map_keyframe({0, m}).inverse() * alignment.T_map_keyframe({1, q});
    sum += (truth.translation - estimate.translation).squaredNorm();
  }
  return std::sqrt(sum / 80.0);
}

/// How far a loop is from what alignment made of it.
double chi2_after(const Alignment& alignment, const LoopConstraint& loop) {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  graph.nodes.push_back({alignment.T_map_keyframe(loop.match), 0, true});
  graph.nodes.push_back({alignment.T_map_keyframe(loop.query), 0, false});
  return edge_chi2(graph, {0, 1, loop.T_match_query, loop.information, 0.0});
}

/// So loose that alignment keeps every loop of `two_maps`.
MergeConfig loose_config() {
  MergeConfig config;
  config.acceptance.consistency_chi2 = 200.0;
  config.acceptance.loop_chi2 = 1000.0;
  return config;
}

/// The loop that agrees least with what alignment made of it.
std::size_t worst_loop(const Alignment& alignment, const Scene& scene) {
  std::size_t worst = 0;
  for (std::size_t i = 1; i < scene.loops.size(); ++i) {
    if (chi2_after(alignment, scene.loops[i]) > chi2_after(alignment, scene.loops[worst])) {
      worst = i;
    }
  }
  return worst;
}

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

TEST_CASE("Maps are joined only if none deforms more than its odometry allows", "[alignment]") {
  // The second robot's odometry is too long by a given share.
  const auto joined = [](double scale_error) {
    Scene scene;
    std::vector<Pose> straight(40);
    std::vector<Pose> scaled(40);
    for (std::size_t i = 0; i < straight.size(); ++i) {
      straight[i].translation.x() = kStepM * static_cast<double>(i);
      scaled[i].translation.x() = (1.0 + scale_error) * straight[i].translation.x();
    }
    scene.truth = {straight, straight};
    scene.sessions = {{straight, 1.0}, {scaled, 0.5}};
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
    config.graph.deformation_per_m = 0.0;
    return align_sessions(scene.sessions, scene.loops, config);
  };
  CHECK(joined(0.001).connected[1]);
  const Alignment deformed = joined(0.1);
  CHECK_FALSE(deformed.connected[1]);
  CHECK(deformed.reason[1] == "the maps would deform more than odometry allows");
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

namespace {

/// Poses straight ahead, `kStepM` apart.
std::vector<Pose> straight(std::size_t count) {
  std::vector<Pose> poses(count);
  for (std::size_t i = 0; i < count; ++i) {
    poses[i].translation.x() = kStepM * static_cast<double>(i);
  }
  return poses;
}

/// A measurement without noise, weighed as if it had a standard deviation of `sigma`.
LoopConstraint exact_loop(KeyframeId query, KeyframeId match, const Pose& T_match_query,
                          double sigma = kLoopSigmaM) {
  LoopConstraint l;
  l.query = query;
  l.match = match;
  l.T_match_query = T_match_query;
  l.information = Matrix6d::Identity() / (sigma * sigma);
  l.overlap = 0.9;
  return l;
}

/// Inter-session loops of two sessions that drive the same way, one at every other keyframe.
void connect_side_by_side(std::vector<LoopConstraint>& loops, std::size_t query, std::size_t match,
                          std::size_t keyframes) {
  for (std::size_t k = 0; k < keyframes; k += 2) {
    loops.push_back(exact_loop({query, k}, {match, k}, Pose{}));
  }
}

}  // namespace

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
  config.graph.deformation_per_m = 0.0;
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
  // Forty keyframes straight ahead that a loop bends by sixty metres.
  Scene scene;
  scene.sessions = {{straight(40), 1.0}};
  scene.loops.push_back(exact_loop({0, 39}, {0, 0}, yaw_pose(0.0, {195.0, 60.0, 0.0}), 0.001));
  MergeConfig config;
  config.acceptance.consistency_chi2 = 1e9;
  config.acceptance.loop_chi2 = 1e9;
  config.graph.cauchy_scale = 1e6;
  config.graph.deformation_per_m = 0.0;
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

TEST_CASE("Refinement leaves the loops of a session alone that is not connected", "[alignment]") {
  Scene scene;
  scene.sessions = {{straight(40), 2.0}, {straight(40), 1.0}, {straight(30), 0.5}};
  connect_side_by_side(scene.loops, 1, 0, 40);
  Pose ahead;
  ahead.translation.x() = 20.0 * kStepM;
  scene.loops.push_back(exact_loop({2, 25}, {2, 5}, ahead));
  const Alignment start = align_sessions(scene.sessions, scene.loops, MergeConfig{});
  REQUIRE(start.decisions.back().accepted);
  REQUIRE_FALSE(start.connected[2]);
  const Alignment refined = refine_alignment(start, scene.sessions, scene.loops, MergeConfig{});
  CHECK(refined.decisions.back().accepted);
  CHECK_FALSE(refined.connected[2]);
  CHECK(refined.reason[2] == start.reason[2]);
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
