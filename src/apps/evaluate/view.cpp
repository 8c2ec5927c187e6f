// `unimapper evaluate view`: what a map's page shows of its evaluation.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/labelled_run.hpp"
#include "src/apps/evaluate/map_alignment.hpp"
#include "src/apps/evaluate/map_loops.hpp"
#include "src/apps/evaluate/shown_map.hpp"
#include "src/apps/evaluate/wrong_points.hpp"
#include "src/apps/view/evaluation_files.hpp"
#include "src/apps/view/map_files.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

/// Of points as text in the report; the rest of it has most of 6 MB.
constexpr std::uint64_t kReportPointBytes = 700'000;

Json rounded_or_null(double value) {
  return std::isfinite(value) ? Json(std::round(value * 1e4) / 1e4) : Json(nullptr);
}

/// The evaluation while it grows.
struct MapEvaluation {
  std::vector<ShownSession> shown;
  std::vector<PairedSession> paired;
  evaluate::Tally labels;  ///< of all sessions
  WrongPoints points;
  Json sessions = Json::array();
  Json ate_m = Json::array();
  Json notes = Json::array();
};

const PairedSession* find_truth(const MapEvaluation& evaluation, const std::string& name) {
  const auto found =
      std::find_if(evaluation.paired.begin(), evaluation.paired.end(),
                   [&](const PairedSession& session) { return session.name == name; });
  return found == evaluation.paired.end() ? nullptr : &*found;
}

/// Position error of every keyframe; null where the truth is not known.
Json errors_along_path(const ShownSession& session, const PairedSession* with_truth,
                       const Pose& T_truth_map) {
  Json errors = Json::array();
  if (with_truth == nullptr || with_truth->estimate.empty()) return errors;
  const auto nearest = evaluate::nearest_in_time(session.stamps_ns, with_truth->truth);
  for (std::size_t k = 0; k < nearest.size(); ++k) {
    if (!nearest[k]) {
      errors.push_back(nullptr);
      continue;
    }
    const Eigen::Vector3d& true_position =
        with_truth->truth[*nearest[k]].T_world_sensor.translation;
    errors.push_back(rounded_or_null((T_truth_map * session.positions[k] - true_position).norm()));
  }
  return errors;
}

/// SA, DA, AA and the number of wrong labels.
void describe_labels(const evaluate::Tally& tally, Json& json) {
  json["SA_percent"] = rounded_or_null(100.0 * tally.static_accuracy());
  json["DA_percent"] = rounded_or_null(100.0 * tally.dynamic_accuracy());
  json["AA_percent"] = rounded_or_null(100.0 * tally.associated_accuracy());
  json["false_static_points"] = tally.missed();
  json["false_dynamic_points"] = tally.lost();
}

void compare_labels(const EvaluateViewOptions& options, const PairedSession& with_truth,
                    std::size_t index, Json& json, MapEvaluation& evaluation) {
  const auto run = std::find_if(options.runs.begin(), options.runs.end(),
                                [&](const auto& named) { return named.first == with_truth.name; });
  if (run == options.runs.end()) {
    evaluation.notes.push_back(with_truth.name + ": no labels were named, so none are compared");
    return;
  }
  const auto truth =
      std::find_if(options.truths.begin(), options.truths.end(),
                   [&](const auto& named) { return named.first == with_truth.name; });
  LabelledRun source(datasets::open_dataset(truth->second), run->second);
  const LabelErrors errors =
      collect_wrong_points(source, {with_truth.truth, with_truth.estimate, session_byte(index)},
                           options.voxel_m, evaluation.points);
  if (!source.has_truth()) {
    evaluation.notes.push_back(with_truth.name + ": the dataset holds no ground-truth labels");
    return;
  }
  if (errors.scans_placeless > 0) {
    evaluation.notes.push_back(with_truth.name + ": " + std::to_string(errors.scans_placeless) +
                               " of " + std::to_string(errors.scans) +
                               " scans have no pose in the map; their wrong points are counted and "
                               "not shown");
  }
  evaluation.labels += errors.score.total;
  describe_labels(errors.score.total, json);
}

void evaluate_sessions(const EvaluateViewOptions& options, const Pose& T_truth_map,
                       MapEvaluation& evaluation) {
  for (std::size_t s = 0; s < evaluation.shown.size(); ++s) {
    const ShownSession& session = evaluation.shown[s];
    const PairedSession* with_truth = find_truth(evaluation, session.name);
    evaluation.ate_m.push_back(errors_along_path(session, with_truth, T_truth_map));
    if (with_truth == nullptr) {
      evaluation.notes.push_back(session.name + ": no truth was named, so it is not evaluated");
      continue;
    }
    Json json = {{"session", s}};
    if (with_truth->pairs.empty()) {
      evaluation.notes.push_back(session.name + ": outside the map, so it has no position errors");
    } else {
      const evaluate::ErrorStatistics error =
          evaluate::trajectory_error(with_truth->pairs, T_truth_map).translation_m;
      json["ATE_rmse_m"] = rounded_or_null(error.rmse);
      json["ATE_max_m"] = rounded_or_null(error.max);
    }
    compare_labels(options, *with_truth, s, json, evaluation);
    evaluation.sessions.push_back(std::move(json));
  }
}

/// Largest error of a session, labels and loops of all.
Json summary_of(const MapEvaluation& evaluation, const evaluate::LoopScore& loops) {
  Json json;
  double worst_m = std::nan("");
  for (const Json& session : evaluation.sessions) {
    if (session.contains("ATE_rmse_m")) worst_m = std::fmax(worst_m, session["ATE_rmse_m"]);
  }
  json["largest_ATE_rmse_m"] = rounded_or_null(worst_m);
  if (evaluation.labels.static_points + evaluation.labels.dynamic_points > 0) {
    describe_labels(evaluation.labels, json);
  }
  const evaluate::PrecisionRecall& accepted = loops.by_pose.operating_point;
  json["keyframes_with_a_right_loop"] = accepted.true_positives;
  json["keyframes_with_a_wrong_loop"] = accepted.false_positives;
  json["keyframes_that_revisit"] = loops.positives;
  json["precision_of_accepted_loops"] = rounded_or_null(accepted.precision);
  json["recall_of_accepted_loops"] = rounded_or_null(accepted.recall);
  return json;
}

Json curve_of(const evaluate::LoopScore& loops) {
  Json curve = Json::array();
  for (const evaluate::CurvePoint& point : loops.by_pose.curve) {
    curve.push_back({rounded_or_null(point.precision), rounded_or_null(point.recall),
                     rounded_or_null(point.confidence)});
  }
  return curve;
}

/// Sessions named twice, or labels without truth, would be left out silently.
void check_names(const EvaluateViewOptions& options) {
  for (const auto& [name, run] : options.runs) {
    const std::string& wanted = name;
    if (std::none_of(options.truths.begin(), options.truths.end(),
                     [&](const auto& truth) { return truth.first == wanted; })) {
      throw std::runtime_error("--run names session \"" + name + "\", --truth does not");
    }
  }
}

}  // namespace

std::string evaluate_view(const EvaluateViewOptions& options) {
  check_names(options);
  const std::filesystem::path folder = options.map / kViewFolder;
  if (!options.replaces && std::filesystem::exists(folder / kEvaluationFile)) {
    throw std::runtime_error((folder / kEvaluationFile).string() +
                             ": is there already; --replace overwrites it");
  }
  MapEvaluation evaluation;
  evaluation.shown = read_shown_map(options.map);
  evaluation.paired = pair_sessions(options.map, options.truths);
  evaluate_sessions(options, align_central(evaluation.paired).T_truth_estimate, evaluation);
  const evaluate::LoopScore loops =
      score_map_loops(options.map, evaluation.shown, evaluation.paired);
  Json json = {{"summary", summary_of(evaluation, loops)},
               {"sessions", evaluation.sessions},
               {"notes", evaluation.notes}};
  std::string printed = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  json["ate_m"] = evaluation.ate_m;
  json["precision_recall"] = curve_of(loops);
  const EvaluationFiles files =
      evaluation_files(json, {{kFalseStatic, make_octree(evaluation.points.false_static)},
                              {kFalseDynamic, make_octree(evaluation.points.false_dynamic)}});
  write_evaluation_files(folder, files);
  const std::filesystem::path report = options.map / "report.html";
  if (std::filesystem::exists(report)) add_evaluation_to_page(report, files, kReportPointBytes);
  return printed;
}

}  // namespace unimapper::apps
