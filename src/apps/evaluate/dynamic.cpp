// `unimapper evaluate dynamic`: accuracy of a run's labels.
#include <stdexcept>

#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/json.hpp"
#include "src/apps/evaluate/labelled_run.hpp"
#include "src/apps/evaluate/motions.hpp"
#include "src/apps/evaluate/pictures.hpp"

namespace unimapper::apps {

RemovalScore score_run(const std::filesystem::path& truth, const std::filesystem::path& run) {
  LabelledRun source(datasets::open_dataset(truth), run);
  RemovalScore score;
  score.all = score.moving = evaluate::score_points(source).total;
  const evaluate::Tally moving = evaluate::score_by_motion(source).moving;
  score.moving.dynamic_points = moving.dynamic_points;
  score.moving.dynamic_removed = moving.dynamic_removed;
  return score;
}

std::string evaluate_dynamic(const EvaluateDynamicOptions& options) {
  if (options.input.finds_mount || options.input.finds_time_offset) {
    throw std::runtime_error("auto is for onboard and inspect: give the values that they printed");
  }
  LabelledRun source(datasets::open_dataset(options.truth, options.input), options.run,
                     options.scans);
  const evaluate::DynamicScore points = evaluate::score_points(source);
  if (!source.has_truth()) {
    throw std::runtime_error(options.truth.string() +
                             ": holds no ground-truth labels to compare the run with");
  }
  const evaluate::MotionScore motion = evaluate::score_by_motion(source);
  std::optional<evaluate::SinceMotionScore> since_motion;
  if (const auto motions = read_motions(options.truth)) {
    since_motion = evaluate::score_since_motion(source, *motions);
  }
  evaluate::BenchmarkConfig config;
  config.neighbour_m = options.neighbour_m;
  config.max_range_m = options.max_range_m;
  const evaluate::BenchmarkScore benchmark = evaluate::score_benchmark(source, config);
  if (!options.pictures.empty()) write_pictures(source, options.pictures, options.worst);
  return dynamic_json(options, source.scan_count(), points, motion, since_motion, benchmark);
}

}  // namespace unimapper::apps
