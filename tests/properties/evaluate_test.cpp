// Invariance of the metrics under rigid motions
#include <catch2/catch.hpp>
#include <vector>

#include "tests/evaluate/random_runs.hpp"

using namespace unimapper;
using namespace unimapper::evaluate;
using namespace unimapper::evaluate::testing;

TEST_CASE("trajectory errors do not depend on the frame of the estimate or of the truth",
          "[frames]") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const RandomTracks tracks = random_tracks(seed);
    const auto pairs = associate(tracks.estimate, tracks.truth, 30'000'000);
    REQUIRE(pairs.size() > 60);
    const Alignment before = align(pairs);
    const TrajectoryError error = trajectory_error(pairs, before.T_truth_estimate);
    CHECK(error.translation_m.rmse > 0.05);
    CHECK(error.translation_m.rmse < 1.0);
    const Pose turn_estimate = random_motion(seed, 80.0, 1.0);
    const Pose turn_truth = random_motion(seed + 10, 80.0, 1.0);
    auto moved = pairs;
    for (PosePair& pair : moved) {
      pair.estimate = turn_estimate * pair.estimate;
      pair.truth = turn_truth * pair.truth;
    }
    const Alignment after = align(moved);
    const Pose expected = turn_truth * before.T_truth_estimate * turn_estimate.inverse();
    CHECK((after.T_truth_estimate.translation - expected.translation).norm() < 1e-6);
    CHECK((after.T_truth_estimate.rotation - expected.rotation).norm() < 1e-8);
    const TrajectoryError same = trajectory_error(moved, after.T_truth_estimate);
    CHECK(same.translation_m.rmse == Approx(error.translation_m.rmse));
    CHECK(same.translation_m.max == Approx(error.translation_m.max));
    CHECK(same.rotation_deg.mean == Approx(error.rotation_deg.mean));
    // Mean square is square of the mean and variance.
    const ErrorStatistics& e = error.translation_m;
    CHECK(e.rmse * e.rmse == Approx(e.mean * e.mean + e.std * e.std));
    CHECK(e.count == pairs.size());
    // No other alignment has a smaller error.
    for (std::uint64_t other = 0; other < 5; ++other) {
      const Pose worse = before.T_truth_estimate * random_motion(other, 0.05, 0.001);
      CHECK(trajectory_error(pairs, worse).translation_m.rmse >= e.rmse);
    }
  }
}

TEST_CASE("precision and recall do not depend on the world's frame, and their counts add up",
          "[frames]") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    LoopScoreConfig config;
    config.threshold_m = 6.0;
    config.min_gap_keyframes = 8;
    config.same_session = seed != 2;
    const RandomLoops run = random_loops(seed, {});
    const RandomLoops moved = random_loops(seed, random_motion(seed, 300.0, 1.0));
    const LoopScore a = score_loops(run.keyframes, run.keyframes, run.loops, config);
    const LoopScore b = score_loops(moved.keyframes, moved.keyframes, moved.loops, config);
    CHECK(a.positives == b.positives);
    CHECK(a.loops + a.loops_left_out == run.loops.size());
    CHECK(a.loops_left_out > 0);
    for (const auto& [x, y] : {std::pair{a.by_distance, b.by_distance}, {a.by_pose, b.by_pose}}) {
      CHECK(x.operating_point.f1 == Approx(y.operating_point.f1));
      CHECK(x.auc == Approx(y.auc));
      CHECK(x.f1_max == Approx(y.f1_max));
      const PrecisionRecall& p = x.operating_point;
      CHECK(p.precision == Approx(static_cast<double>(p.true_positives) /
                                  static_cast<double>(p.true_positives + p.false_positives)));
      CHECK(p.f1 == Approx(2.0 * p.precision * p.recall / (p.precision + p.recall)));
      CHECK(x.f1_max >= p.f1 - 1e-12);
      for (std::size_t i = 1; i < x.curve.size(); ++i) {
        CHECK(x.curve[i].confidence < x.curve[i - 1].confidence);
        CHECK(x.curve[i].recall >= x.curve[i - 1].recall);
      }
    }
    CHECK(a.translation_error_m.rmse == Approx(b.translation_error_m.rmse));
    CHECK(a.rotation_error_deg.max == Approx(b.rotation_error_deg.max));
  }
}

namespace {

void check_equal(const Tally& a, const Tally& b) {
  CHECK(a.static_points == b.static_points);
  CHECK(a.static_kept == b.static_kept);
  CHECK(a.dynamic_points == b.dynamic_points);
  CHECK(a.dynamic_removed == b.dynamic_removed);
}

template <std::size_t n>
Tally sum(const std::array<Tally, n>& tallies) {
  Tally total;
  for (const Tally& tally : tallies) total += tally;
  return total;
}

}  // namespace

TEST_CASE("scores of labels do not depend on the world's frame, and their parts add up",
          "[frames]") {
  RandomScans scans(5, {});
  RandomScans moved(5, random_motion(6, 50.0, 1.0));
  const DynamicScore points = score_points(scans);
  check_equal(points.total, score_points(moved).total);
  check_equal(points.total, sum(points.by_class));
  check_equal(points.total, sum(points.by_range));
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < scans.scan_count(); ++i) all += scans.scan(i).points.size();
  CHECK(points.total.static_points + points.total.dynamic_points + points.ignored == all);
  BenchmarkConfig config;
  config.neighbour_m = 0.3F;
  const BenchmarkScore benchmark = score_benchmark(scans, config);
  const BenchmarkScore same = score_benchmark(moved, config);
  check_equal(benchmark.score.total, sum(benchmark.score.by_class));
  CHECK(benchmark.score.total.static_points == same.score.total.static_points);
  // Distances of points to their neighbours are rounded alike but for a few.
  CHECK(static_cast<double>(benchmark.score.total.dynamic_removed) ==
        Approx(static_cast<double>(same.score.total.dynamic_removed)).margin(3.0));
  const MotionInterval motions[] = {{7, 2, 5}, {8, 0, 9}, {10, 4, 4}};
  const SinceMotionScore since = score_since_motion(scans, motions);
  CHECK(since.moving.dynamic_points + since.paused.dynamic_points ==
        since.since.total.dynamic_points);
  check_equal(since.since.total, score_since_motion(moved, motions).since.total);
  // Every point is static, or moves, pauses, has not begun to move, or is ignored.
  CHECK(since.since.total.static_points + since.since.total.dynamic_points +
            since.before.dynamic_points + since.since.ignored >=
        all);
}

TEST_CASE("agreement and entropy of clouds do not depend on their frame", "[frames]") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Pose turn = random_motion(seed + 20, 10.0, 1.0);
    const Pose apart = random_motion(seed, 0.2, 0.02);
    const auto first = random_cloud(seed, {}, 1500);
    const auto second = random_cloud(seed, apart, 1300);
    const CloudAgreement a = compare_clouds(first, second, 0.8);
    const CloudAgreement b =
        compare_clouds(random_cloud(seed, turn, 1500), random_cloud(seed, turn * apart, 1300), 0.8);
    CHECK(b.ac_rmse_m == Approx(a.ac_rmse_m).epsilon(1e-3));
    CHECK(b.cd_l2_m == Approx(a.cd_l2_m).epsilon(1e-3));
    // Which cloud comes first does not matter to any distance.
    const CloudAgreement c = compare_clouds(second, first, 0.8);
    CHECK(c.ac_mean_m == Approx(a.ac_mean_m));
    CHECK(c.cd_l2_squared_m2 == Approx(a.cd_l2_squared_m2));
    CHECK(c.inliers_first == a.inliers_second);
    EntropyConfig config;
    config.radius_m = 1.5;
    const MapEntropy e = map_entropy(first, config);
    const MapEntropy f = map_entropy(random_cloud(seed, turn, 1500), config);
    CHECK(f.mean == Approx(e.mean).epsilon(1e-2));
    CHECK(e.points + e.skipped == first.size());
  }
}
