// Metrics of random runs: trajectories, loops, labels and clouds
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "expected_text.hpp"
#include "tests/evaluate/random_runs.hpp"
#include "unimapper/evaluate/worst_frames.hpp"
#include "words.hpp"

using namespace unimapper;
using namespace unimapper::evaluate;
using namespace unimapper::evaluate::testing;
using namespace unimapper::regression;

namespace {

std::string errors_text(const ErrorStatistics& e) {
  return join("max", fixed(e.max, 4), "mean", fixed(e.mean, 4), "median", fixed(e.median, 4), "min",
              fixed(e.min, 4), "rmse", fixed(e.rmse, 4), "std", fixed(e.std, 4), "of",
              count(e.count));
}

std::string figures_text(const char* name, const LoopFigures& figures) {
  const PrecisionRecall& p = figures.operating_point;
  std::string text =
      join(name, "precision", fixed(p.precision, 4), "recall", fixed(p.recall, 4), "f1",
           fixed(p.f1, 4), "true", count(p.true_positives), "false", count(p.false_positives),
           "missed", count(p.false_negatives), "f1 max", fixed(figures.f1_max, 4), "auc",
           fixed(figures.auc, 4), "full precision", fixed(figures.recall_at_full_precision, 4)) +
      "\n";
  for (const CurvePoint& point : figures.curve) {
    text += join("  curve", fixed(point.confidence, 3), fixed(point.precision, 4),
                 fixed(point.recall, 4)) +
            "\n";
  }
  return text;
}

std::string tally_text(const Tally& t) {
  return join(count(t.static_kept), "of", count(t.static_points), "kept", count(t.dynamic_removed),
              "of", count(t.dynamic_points), "removed lost", count(t.lost()), "missed",
              count(t.missed()), "SA", fixed(t.static_accuracy(), 4), "DA",
              fixed(t.dynamic_accuracy(), 4), "AA", fixed(t.associated_accuracy(), 4), "HA",
              fixed(t.harmonic_accuracy(), 4));
}

std::string score_text(const char* name, const DynamicScore& score) {
  std::string text = join(name, tally_text(score.total), "ignored", count(score.ignored)) + "\n";
  for (std::size_t i = 0; i < kClassCount; ++i) {
    const Tally& t = score.by_class[i];
    if (t.static_points + t.dynamic_points == 0) continue;
    text += join("  class", class_name(i), tally_text(t)) + "\n";
  }
  for (std::size_t i = 0; i < kRangeBinCount; ++i) {
    text += join("  range", range_bin_name(i), tally_text(score.by_range[i])) + "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("errors of random trajectories, as before", "[regression]") {
  std::string text;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const RandomTracks tracks = random_tracks(seed);
    const auto pairs = associate(tracks.estimate, tracks.truth, 30'000'000);
    const evaluate::Alignment alignment = align(pairs);
    const TrajectoryError error = trajectory_error(pairs, alignment.T_truth_estimate);
    text += join("pairs", count(pairs.size()), "aligned", pose_text(alignment.T_truth_estimate),
                 alignment.used_orientations ? "by orientations" : "by positions") +
            "\n  metres " + errors_text(error.translation_m) + "\n  degrees " +
            errors_text(error.rotation_deg) + "\n";
  }
  check_expected("evaluate_trajectory", text);
}

TEST_CASE("precision and recall of random loops, as before", "[regression]") {
  std::string text;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const RandomLoops run = random_loops(seed, {});
    LoopScoreConfig config;
    config.threshold_m = 6.0;
    config.pose_translation_m = 1.2;
    config.pose_rotation_deg = 4.0;
    config.min_gap_keyframes = 8;
    config.same_session = seed != 2;
    if (seed == 3) config.common_view = run.common_view;
    const LoopScore score = score_loops(run.keyframes, run.keyframes, run.loops, config);
    text += join("queries", count(score.queries), "positives", count(score.positives), "loops",
                 count(score.loops), "left out", count(score.loops_left_out), "view positives",
                 count(score.view_positives)) +
            "\n" + figures_text("by distance", score.by_distance) +
            figures_text("by pose", score.by_pose) + figures_text("by view", score.by_view) +
            "  metres " + errors_text(score.translation_error_m) + "\n  degrees " +
            errors_text(score.rotation_error_deg) + "\n";
  }
  check_expected("evaluate_loops", text);
}

TEST_CASE("scores of random labels, as before", "[regression]") {
  RandomScans scans(5, {});
  std::string text = score_text("points", score_points(scans));
  BenchmarkConfig config;
  config.neighbour_m = 0.3F;
  config.max_range_m = 40.0F;
  config.ego_range_m = 4.0F;
  config.batch_points = 300;
  const BenchmarkScore benchmark = score_benchmark(scans, config);
  text += score_text("benchmark", benchmark.score) + "with unlabelled " +
          tally_text(benchmark.with_unlabelled) + "\n";
  const MotionScore motion = score_by_motion(scans, 4);
  text +=
      "moving " + tally_text(motion.moving) + "\nstanding " + tally_text(motion.standing) + "\n";
  const MotionInterval motions[] = {{3, 2, 5}, {5, 7, 9}, {9, 0, 1}, {3, 8, 8}};
  const SinceMotionScore since = score_since_motion(scans, motions);
  text += score_text("since", since.since) + "moving " + tally_text(since.moving) + "\npaused " +
          tally_text(since.paused) + "\nbefore " + tally_text(since.before) + "\n";
  const auto frames = score_frames(scans);
  text += "worst";
  for (const std::size_t frame : worst_frames(frames, 4, 2)) text += " " + count(frame);
  text += "\n";
  std::vector<ObjectErrors> earlier;
  for (const std::size_t i : {2U, 7U}) {
    const auto objects = errors_by_object(scans.scan(i));
    for (const ObjectErrors& object : objects) {
      text += join("object", count(object.label & 0xFFFFU), count(object.label >> 16U),
                   tally_text(object.tally), "at", vector_text(object.center), "wrong at",
                   vector_text(object.wrong_center_sensor), "range",
                   fixed(static_cast<double>(object.wrong_range_m), 3), "moved",
                   fixed(displacement_m(object, earlier), 3)) +
              "\n";
    }
    earlier = objects;
  }
  check_expected("evaluate_labels", text);
}

TEST_CASE("agreement and entropy of random clouds, as before", "[regression]") {
  std::string text;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto first = random_cloud(seed, {}, 1500);
    const auto second = random_cloud(seed, random_motion(seed, 0.2, 0.02), 1300);
    for (const double tau_m : {0.3, 1.0}) {
      const CloudAgreement a = compare_clouds(first, second, tau_m);
      text += join("agreement", fixed(a.ac_rmse_m, 5), fixed(a.ac_mean_m, 5), fixed(a.cd_l2_m, 5),
                   fixed(a.cd_l2_squared_m2, 5), count(a.inliers_first), count(a.inliers_second)) +
              "\n";
    }
    EntropyConfig config;
    config.radius_m = 1.5;
    config.min_neighbours = 8;
    config.max_queries = 700;
    const MapEntropy entropy = map_entropy(first, config);
    text += join("entropy", fixed(entropy.mean, 5), count(entropy.points), count(entropy.skipped)) +
            "\n";
  }
  check_expected("evaluate_clouds", text);
}
