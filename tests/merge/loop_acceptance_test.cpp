// Loop acceptance at the boundary of every threshold
#include "src/merge/loops/loop_acceptance.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "src/merge/loops/loop_cycle.hpp"
#include "src/merge/registration/weak_axis.hpp"
#include "tests/merge/poses.hpp"
#include "unimapper/merge/alignment.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

constexpr double kSigmaM = 0.2;
constexpr double kSigmaRad = 0.01;
constexpr double kStepM = 5.0;

/// Keyframes along x, 5 m apart, unless the robot stands.
SessionPath straight(std::size_t count, double step_m = kStepM) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) poses.push_back(shifted(step_m * static_cast<double>(i)));
  return {poses, OdometryNoiseConfig{}};
}

/// A loop by which both sessions share one frame, but for `error` in the query's frame.
LoopConstraint loop(const SessionPath& query_path, std::size_t query, const SessionPath& match_path,
                    std::size_t match, const Pose& error = {}, double overlap = 0.5) {
  LoopConstraint made;
  made.query = {1, query};
  made.match = {0, match};
  made.T_match_query = match_path[match].inverse() * query_path[query] * error;
  made.information.setZero();
  made.information.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / (kSigmaM * kSigmaM));
  made.information.bottomRightCorner<3, 3>().diagonal().setConstant(1.0 / (kSigmaRad * kSigmaRad));
  made.overlap = overlap;
  return made;
}

/// True loops of two robots that drove the same street, at the given keyframes of both.
std::vector<LoopConstraint> true_loops(const SessionPath& path,
                                       const std::vector<std::size_t>& keyframes,
                                       double overlap = 0.5) {
  std::vector<LoopConstraint> loops;
  for (const std::size_t k : keyframes) loops.push_back(loop(path, k, path, k, {}, overlap));
  return loops;
}

ConsistencySet set_of(const std::vector<LoopConstraint>& loops, const SessionPath& path,
                      const AcceptanceConfig& config = {}) {
  return inter_session_consistency(loops, path, path, config);
}

const SessionPath kPath = straight(20);

/// Perceptual aliasing: loops that put the query so many keyframes farther on.
void add_aliased(std::vector<LoopConstraint>& loops, const SessionPath& path, std::size_t farther) {
  for (const std::size_t k : {4U, 8U}) {
    loops.push_back(loop(path, k, path, k + farther));
    loops.back().T_match_query = Pose{};
  }
}

}  // namespace

TEST_CASE("Chi square of a cycle weighs each axis by its own variance", "[acceptance]") {
  const SessionPath& path = kPath;
  const LoopConstraint a = loop(path, 2, path, 2);
  const auto chi2 = [&](const Pose& error) {
    return cycle_chi2(a, loop(path, 10, path, 10, error), path, path);
  };
  CHECK(chi2({}) == Approx(0.0).margin(1e-9));
  // Along the way no rotation has a lever.
  const double ahead = 2.0 * kSigmaM * kSigmaM + 2.0 * path.variance(2, 10).translation;
  CHECK(chi2(shifted(0.7)) == Approx(0.49 / ahead));
  // Across it the first loop's heading has one, and shows in the heading at the end.
  const double lever = (path[10].translation - path[2].translation).norm();
  const double turn = 2.0 * kSigmaRad * kSigmaRad + 2.0 * path.variance(2, 10).rotation;
  const double across = ahead + kSigmaRad * kSigmaRad * lever * lever;
  const double both = kSigmaRad * kSigmaRad * lever;
  const double determinant = across * turn - both * both;
  CHECK(chi2(shifted(0.0, 0.7)) == Approx(0.49 * turn / determinant));
  CHECK(chi2(yaw_pose(0.05)) == Approx(0.0025 * across / determinant));
}

TEST_CASE("Two loops agree up to the threshold of chi square and not beyond", "[acceptance]") {
  const SessionPath& path = kPath;
  const AcceptanceConfig config;
  const bool by_turn = GENERATE(false, true);
  const auto loops = [&](double size) {
    const Pose error = by_turn ? yaw_pose(size) : shifted(0.0, size);
    return std::vector<LoopConstraint>{loop(path, 2, path, 2), loop(path, 10, path, 10, error)};
  };
  const std::vector<LoopConstraint> unit = loops(0.01);
  const double chi2_of_unit = cycle_chi2(unit[0], unit[1], path, path);
  for (const double share : {0.99, 1.01}) {
    const double size = 0.01 * std::sqrt(share * config.consistency_chi2 / chi2_of_unit);
    INFO("share " << share << (by_turn ? " in rotation" : " in translation"));
    CHECK(set_of(loops(size), path).inliers.size() == (share < 1.0 ? 2 : 1));
  }
}

TEST_CASE("A loop that is weak along a corridor agrees along it and not across", "[acceptance]") {
  const SessionPath& path = kPath;
  const LoopConstraint sure = loop(path, 10, path, 10);
  const auto weak_along_x = [&](const Pose& error) {
    LoopConstraint corridor = loop(path, 2, path, 2, error);
    corridor.information(0, 0) = 1.0 / 100.0;
    return cycle_chi2(corridor, sure, path, path);
  };
  CHECK(weak_along_x(shifted(3.0)) < 0.1);
  CHECK(weak_along_x(shifted(0.0, 3.0)) > AcceptanceConfig{}.consistency_chi2);
  CHECK(weak_along_x(shifted(0.0, 0.0, 3.0)) > AcceptanceConfig{}.consistency_chi2);
}

TEST_CASE("A loop with a free axis is none where odometry puts it elsewhere along it",
          "[acceptance]") {
  const SessionPath path = straight(200, 1.0);
  const auto is_plausible = [&](const Pose& error) {
    LoopConstraint corridor = loop(path, 60, path, 20, error);
    corridor.information = weakened(corridor.information, Eigen::Vector3d::UnitX());
    const std::vector<LoopConstraint> alone{corridor};
    return intra_session_consistency(alone, path, {}).waiting.size() == 1;
  };
  CHECK(is_plausible(shifted(3.0)));
  CHECK_FALSE(is_plausible(shifted(0.0, 3.0)));
  CHECK_FALSE(is_plausible(shifted(20.0)));
}

TEST_CASE("Maps whose position along one direction few loops know wait", "[acceptance]") {
  std::vector<LoopConstraint> loops = true_loops(kPath, {2, 4, 6, 8, 10, 12});
  const auto weaken = [&](std::size_t i) {
    loops[i].information(0, 0) = 0.99 / std::pow(AcceptanceConfig{}.vote_sigma_m, 2);
  };
  for (const std::size_t i : {0U, 1U, 2U, 3U}) weaken(i);
  CHECK(set_of(loops, kPath).state == PairState::kConfirmed);
  weaken(4);
  const ConsistencySet one = set_of(loops, kPath);
  CHECK(one.state == PairState::kProvisional);
  CHECK(one.reason == "the position along one direction is known to 1 of 6 loops");
}

TEST_CASE("Loops that differ by less than drift over the whole way compete all the same",
          "[acceptance]") {
  // Every other loop 3 m up, as between two decks: far ones agree, neighbours do not.
  const SessionPath path = straight(100);
  const AcceptanceConfig config;
  std::vector<LoopConstraint> loops;
  for (std::size_t k = 0; k < 100; k += 10) {
    loops.push_back(loop(path, k, path, k));
    loops.push_back(loop(path, k + 5, path, k + 5, shifted(0.0, 0.0, 3.0)));
  }
  REQUIRE(cycle_chi2(loops.front(), loops.back(), path, path) < config.consistency_chi2);
  REQUIRE(cycle_chi2(loops[0], loops[1], path, path) > config.consistency_chi2);
  const ConsistencySet set = set_of(loops, path);
  CHECK(set.state == PairState::kProvisional);
  CHECK(set.competing >= 5);
}

TEST_CASE("Loops that drift apart along the way belong to one hypothesis", "[acceptance]") {
  // The query's odometry is too long by 4 %, far more than its model allows.
  const SessionPath path = straight(100);
  std::vector<LoopConstraint> loops;
  for (std::size_t k = 0; k < 100; k += 4) {
    loops.push_back(loop(path, k, path, k, shifted(0.04 * kStepM * static_cast<double>(k))));
  }
  const ConsistencySet set = set_of(loops, path);
  REQUIRE(set.inliers.size() < loops.size() - 4);
  CHECK(set.competing == 0);
  CHECK(set.state == PairState::kConfirmed);
}

TEST_CASE("Three loops connect two maps, two do not unless both overlap strongly", "[acceptance]") {
  constexpr double kStrong = AcceptanceConfig::kStrongOverlap;
  std::vector<LoopConstraint> one_weak = true_loops(kPath, {2, 10}, kStrong);
  one_weak[1].overlap -= 0.01;
  struct Row {
    std::vector<LoopConstraint> loops;
    const char* reason;
  };
  for (const Row& row : {Row{true_loops(kPath, {2, 6, 10}), ""},
                         Row{true_loops(kPath, {2, 10}), "too few consistent loops: 2 of 2"},
                         Row{true_loops(kPath, {2, 10}, kStrong), ""},
                         Row{one_weak, "too few consistent loops: 2 of 2"},
                         Row{true_loops(kPath, {2}, 1.0), "too few consistent loops: 1 of 1"},
                         Row{{}, "no loops found"}}) {
    const ConsistencySet set = set_of(row.loops, kPath);
    CHECK(set.reason == row.reason);
    CHECK(set.state == (set.reason.empty() ? PairState::kConfirmed : PairState::kRefused));
  }
}

TEST_CASE("Loops must span the configured path in both maps, strong ones half of it",
          "[acceptance]") {
  // The last query moved twice as far as the match: the shorter of the two counts.
  const SessionPath dense = straight(40, 2.5);
  struct Row {
    std::vector<LoopConstraint> loops;
    const SessionPath& match;
    double longest_m;
  };
  const Row rows[] = {
      {true_loops(kPath, {4, 6, 8}), kPath, 20.0},
      {true_loops(kPath, {4, 6, 8}, 0.9), kPath, 40.0},
      {{loop(kPath, 4, dense, 8), loop(kPath, 6, dense, 11), loop(kPath, 8, dense, 14)},
       dense,
       15.0}};
  for (const Row& row : rows) {
    INFO(row.longest_m << " m");
    AcceptanceConfig config;
    config.min_span_m = row.longest_m - 0.1;
    CHECK(inter_session_consistency(row.loops, kPath, row.match, config).state ==
          PairState::kConfirmed);
    config.min_span_m = row.longest_m + 0.1;
    CHECK(inter_session_consistency(row.loops, kPath, row.match, config).reason ==
          "loops span too short a path");
  }
}

TEST_CASE("Loops over a short path connect maps where most keyframes confirm them",
          "[acceptance]") {
  const SessionPath path = straight(60);
  const ConsistencySet set = set_of(true_loops(path, {4, 5, 6}), path);
  CHECK(set.state == PairState::kRefused);
  REQUIRE(set.is_short);
  const auto why = [&](std::size_t supporting, std::size_t contradicting) {
    return reason_to_wait(set, {supporting, contradicting, {}}, AcceptanceConfig{});
  };
  CHECK(why(3, 0).empty());
  CHECK(why(4, 2).empty());
  CHECK(why(2, 0) == "too few keyframes confirm them: 2 of 2");
  CHECK(why(5, 3) == "too few keyframes confirm them: 5 of 8");
  CHECK_FALSE(set_of(true_loops(path, {4, 5}), path).is_short);
  std::vector<LoopConstraint> competing = true_loops(path, {4, 5, 6});
  add_aliased(competing, path, 20);
  CHECK_FALSE(set_of(competing, path).is_short);
}

TEST_CASE("The consistency set must exceed a competing one by the margin", "[acceptance]") {
  const SessionPath path = straight(60);
  std::vector<LoopConstraint> four = true_loops(path, {2, 6, 10, 14});
  add_aliased(four, path, 20);
  const ConsistencySet ahead = set_of(four, path);
  CHECK(ahead.state == PairState::kConfirmed);
  CHECK(ahead.distinct == 4);
  CHECK(ahead.competing == 2);
  CHECK(ahead.inliers == std::vector<std::size_t>{0, 1, 2, 3});
  CHECK(ahead.competing_sets.empty());

  std::vector<LoopConstraint> three = true_loops(path, {2, 6, 10});
  add_aliased(three, path, 20);
  const ConsistencySet ambiguous = set_of(three, path);
  CHECK(ambiguous.reason == "ambiguous: 2 loops contradict 3");
  REQUIRE(ambiguous.competing_sets.size() == 1);
  CHECK(apart_m(ambiguous.competing_sets[0].T_match_session_query_session, shifted(100.0)) < 1.0);

  // A single outlier is no competing set.
  const ConsistencySet alone = set_of({three.begin(), three.end() - 1}, path);
  CHECK(alone.state == PairState::kConfirmed);
  CHECK(alone.competing == 0);

  // Four that compete are too many to be told apart; three are named.
  for (const std::size_t farther : {26U, 32U, 38U}) {
    add_aliased(three, path, farther);
    const ConsistencySet set = set_of(three, path);
    CHECK(set.state == PairState::kProvisional);
    CHECK(set.competing_sets.size() == (farther == 26 ? 2 : farther == 32 ? 3 : 0));
  }
}

TEST_CASE("Loops count as distinct only if they are apart along both paths", "[acceptance]") {
  const SessionPath standing = straight(20, 0.0);
  for (const bool is_query_standing : {false, true}) {
    const SessionPath& query = is_query_standing ? standing : kPath;
    const SessionPath& match = is_query_standing ? kPath : standing;
    std::vector<LoopConstraint> loops;
    for (const std::size_t k : {2U, 6U, 10U}) loops.push_back(loop(query, k, match, k));
    const ConsistencySet set = inter_session_consistency(loops, query, match, AcceptanceConfig{});
    CHECK(set.inliers.size() == 3);
    CHECK(set.distinct == 1);
    CHECK(set.reason == "too few consistent loops: 1 of 3");
  }
  // Just nearer and just farther apart than the spacing.
  AcceptanceConfig config;
  config.distinct_m = kStepM + 0.1;
  CHECK(set_of(true_loops(kPath, {2, 3, 4}), kPath, config).distinct == 2);
  config.distinct_m = kStepM - 0.1;
  CHECK(set_of(true_loops(kPath, {2, 3, 4}), kPath, config).distinct == 3);
}

TEST_CASE("Span and spacing shrink with what the keyframes see, down to a floor", "[acceptance]") {
  const AcceptanceConfig config;
  const auto scale = [&](double extent_m) {
    const AcceptanceConfig scaled = scaled_to_extent(config, extent_m);
    CHECK(scaled.distinct_m / config.distinct_m == Approx(scaled.min_span_m / config.min_span_m));
    CHECK(scaled.min_loops == config.min_loops);
    CHECK(scaled.margin == config.margin);
    return scaled.min_span_m / config.min_span_m;
  };
  CHECK(scale(AcceptanceConfig::kFullExtentM) == 1.0);
  CHECK(scale(10.0 * AcceptanceConfig::kFullExtentM) == 1.0);
  CHECK(scale(0.5 * AcceptanceConfig::kFullExtentM) == Approx(0.5));
  CHECK(scale(0.01) == Approx(AcceptanceConfig::kSmallestScale));
  // Unknown is far.
  CHECK(scale(0.0) == 1.0);
}

TEST_CASE("A loop within a session is taken up to the drift that odometry may have",
          "[acceptance]") {
  const SessionPath path = straight(40);
  const AcceptanceConfig config;
  const RelativeVariance drift = path.variance(3, 30);
  const bool by_turn = GENERATE(false, true);
  for (const double share : {0.99, 1.01}) {
    const double chi2 = share * config.consistency_chi2;
    const Pose error =
        by_turn ? yaw_pose(std::sqrt(chi2 * (drift.rotation + kSigmaRad * kSigmaRad)))
                : shifted(0.0, std::sqrt(chi2 * (drift.translation + kSigmaM * kSigmaM)));
    // Nothing but odometry can contradict a loop that is alone.
    const std::vector<LoopConstraint> alone{loop(path, 30, path, 3, error)};
    const IntraSessionLoops found = intra_session_consistency(alone, path, config);
    INFO("share " << share << (by_turn ? " in rotation" : " in translation"));
    CHECK(found.accepted.empty());
    CHECK(found.waiting.size() == (share < 1.0 ? 1 : 0));
  }
}

TEST_CASE("Loops within a session wait until another one at another place confirms them",
          "[acceptance]") {
  const SessionPath path = straight(200, 1.0);
  const AcceptanceConfig config;
  const auto found = [&](const std::vector<std::size_t>& queries) {
    std::vector<LoopConstraint> loops;
    // There and back again: loops join what lies as far before the turn as after it.
    for (const std::size_t q : queries) loops.push_back(loop(path, q, path, q - 100));
    return intra_session_consistency(loops, path, config);
  };
  const auto spacing = static_cast<std::size_t>(0.5 * config.min_span_m);
  CHECK(found({120}).waiting.size() == 1);
  CHECK(found({120, 120 + spacing - 1}).waiting.size() == 2);
  CHECK(found({120, 120 + spacing}).accepted.size() == 2);
  // Far away odometry is no longer sure enough to contradict a wrong one.
  const SessionPath far = straight(2000, 1.0);
  const std::vector<LoopConstraint> ends{loop(far, 1000, far, 10), loop(far, 1900, far, 910)};
  CHECK(intra_session_consistency(ends, far, config).waiting.size() == 2);
}

TEST_CASE("Loops that agree with each other and not with odometry tell how far it drifts",
          "[acceptance]") {
  const SessionPath path = straight(200, 1.0);
  const auto drift = [&](double error_m, std::size_t count, std::size_t accepted) {
    std::vector<LoopConstraint> refused;
    for (std::size_t i = 0; i < count; ++i) {
      refused.push_back(loop(path, 120 + 10 * i, path, 10 + 10 * i, shifted(0.0, error_m)));
    }
    // Two that agree with nothing.
    refused.push_back(loop(path, 150, path, 12, shifted(7.0, 30.0)));
    refused.push_back(loop(path, 190, path, 100, shifted(-20.0)));
    return drift_by_refused(refused, accepted, path, {});
  };
  const double variance = path.variance(10, 120).translation + kSigmaM * kSigmaM;
  const double error_m = 4.0 * std::sqrt(6.0 * variance);
  CHECK(drift(error_m, 5, 0) == Approx(4.0).epsilon(0.02));
  CHECK(drift(error_m, 5, 4) == Approx(4.0).epsilon(0.02));
  CHECK(drift(error_m, 5, 5) == 1.0);  // as many say that it does not
  CHECK(drift(error_m, 2, 0) == 1.0);
  CHECK(drift(0.1 * error_m, 5, 0) == 1.0);
  CHECK(drift(2.5 * error_m, 5, 0) == 1.0);  // another place that looks alike
}

TEST_CASE("A map is fitted to another by a single loop as well as by many", "[acceptance]") {
  const Pose T_match_query = turned_about({1, 2, 3}, 0.7, {10.0, -4.0, 2.0});
  std::vector<LoopConstraint> loops = true_loops(kPath, {2, 6, 10});
  for (LoopConstraint& l : loops) {
    l.T_match_query = kPath[l.match.keyframe].inverse() * T_match_query * kPath[l.query.keyframe];
  }
  const std::vector<std::vector<std::size_t>> choices{{1}, {0, 1, 2}};
  for (const auto& chosen : choices) {
    const Pose fitted = fit_session_transform(loops, chosen, kPath, kPath);
    CHECK(apart_m(fitted, T_match_query) < 1e-6);
    CHECK(rotation_angle(fitted.rotation.transpose() * T_match_query.rotation) < 1e-6);
  }
}
