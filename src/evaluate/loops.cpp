// Precision and recall of loop search.
#include "loops.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <utility>

namespace unimapper::evaluate {
namespace {

double harmonic_mean(double a, double b) { return a + b > 0.0 ? 2.0 * a * b / (a + b) : 0.0; }

/// Errors of a reported loop.
struct ScoredLoop {
  double confidence = 0.0;
  bool true_by_distance = false;
  bool true_by_pose = false;
  double translation_error_m = 0.0;
  double rotation_error_deg = 0.0;
};

/// One query and its best loops.
struct Query {
  bool positive = false;
  bool shares_view = false;
  std::optional<ScoredLoop> best;      // of all loops
  std::optional<ScoredLoop> accepted;  // of the accepted ones
};

bool eligible(const TrueKeyframe& query, const TrueKeyframe& reference,
              const LoopScoreConfig& config) {
  return !config.same_session ||
         std::uint64_t{reference.keyframe} + config.min_gap_keyframes <= query.keyframe;
}

double distance_m(const TrueKeyframe& a, const TrueKeyframe& b) {
  return (a.T_world_sensor.translation - b.T_world_sensor.translation).norm();
}

bool has_revisit(const TrueKeyframe& query, std::span<const TrueKeyframe> references,
                 const LoopScoreConfig& config) {
  return std::any_of(references.begin(), references.end(), [&](const TrueKeyframe& reference) {
    return eligible(query, reference, config) && distance_m(query, reference) <= config.threshold_m;
  });
}

bool has_common_view(std::size_t query, std::span<const TrueKeyframe> queries,
                     std::span<const TrueKeyframe> references, const LoopScoreConfig& config) {
  for (std::size_t i = 0; i < references.size(); ++i) {
    if (config.common_view[query * references.size() + i] == 0) continue;
    if (eligible(queries[query], references[i], config)) return true;
  }
  return false;
}

ScoredLoop score_loop(const LoopRecord& loop, const TrueKeyframe& query, const TrueKeyframe& match,
                      const LoopScoreConfig& config) {
  const Pose T_match_query_true = match.T_world_sensor.inverse() * query.T_world_sensor;
  const Pose error = T_match_query_true.inverse() * loop.T_match_query;
  ScoredLoop scored;
  scored.confidence = loop.confidence;
  scored.translation_error_m = error.translation.norm();
  scored.rotation_error_deg = rotation_angle(error.rotation) * kDegreesPerRadian;
  scored.true_by_distance = distance_m(query, match) <= config.threshold_m;
  scored.true_by_pose = scored.translation_error_m <= config.pose_translation_m &&
                        scored.rotation_error_deg <= config.pose_rotation_deg;
  return scored;
}

void keep_better(std::optional<ScoredLoop>& best, const ScoredLoop& loop) {
  if (!best || loop.confidence > best->confidence) best = loop;
}

/// What counts as a positive query and as a true loop.
struct Criterion {
  bool Query::*is_positive;
  bool ScoredLoop::*is_true;
};

PrecisionRecall operating_point(const std::vector<Query>& queries, Criterion criterion) {
  PrecisionRecall result;
  std::size_t positives = 0;
  std::size_t found = 0;
  for (const Query& query : queries) {
    positives += query.*criterion.is_positive ? 1 : 0;
    if (!query.accepted) continue;
    const bool right = (*query.accepted).*criterion.is_true;
    ++(right ? result.true_positives : result.false_positives);
    found += right && query.*criterion.is_positive ? 1 : 0;
  }
  result.false_negatives = positives - found;
  const std::size_t accepted = result.true_positives + result.false_positives;
  if (accepted > 0) {
    result.precision = static_cast<double>(result.true_positives) / static_cast<double>(accepted);
  }
  if (positives > 0) result.recall = static_cast<double>(found) / static_cast<double>(positives);
  if (accepted + positives > 0) {
    result.f1 =
        accepted > 0 && positives > 0 ? harmonic_mean(result.precision, result.recall) : 0.0;
  }
  return result;
}

std::vector<CurvePoint> sweep(const std::vector<Query>& queries, Criterion criterion) {
  std::vector<RankedLoop> loops;
  std::size_t positives = 0;
  for (const Query& query : queries) {
    positives += query.*criterion.is_positive ? 1 : 0;
    if (!query.best) continue;
    loops.push_back(
        {query.best->confidence, (*query.best).*criterion.is_true, query.*criterion.is_positive});
  }
  return precision_recall_curve(std::move(loops), positives);
}

LoopFigures figures(const std::vector<Query>& queries, Criterion criterion) {
  LoopFigures result;
  result.operating_point = operating_point(queries, criterion);
  result.curve = sweep(queries, criterion);
  double previous_recall = 0.0;
  double previous_precision = result.curve.empty() ? 0.0 : result.curve.front().precision;
  for (const CurvePoint& point : result.curve) {
    result.f1_max = std::max(result.f1_max, harmonic_mean(point.precision, point.recall));
    result.auc += 0.5 * (point.precision + previous_precision) * (point.recall - previous_recall);
    if (point.precision == 1.0) result.recall_at_full_precision = point.recall;
    previous_recall = point.recall;
    previous_precision = point.precision;
  }
  return result;
}

std::unordered_map<std::uint32_t, std::size_t> index_by_keyframe(
    std::span<const TrueKeyframe> keyframes) {
  std::unordered_map<std::uint32_t, std::size_t> index;
  for (std::size_t i = 0; i < keyframes.size(); ++i) index.emplace(keyframes[i].keyframe, i);
  return index;
}

}  // namespace

std::vector<CurvePoint> precision_recall_curve(std::vector<RankedLoop> loops,
                                               std::size_t positives) {
  std::vector<CurvePoint> curve;
  if (positives == 0) return curve;
  std::stable_sort(loops.begin(), loops.end(), [](const RankedLoop& a, const RankedLoop& b) {
    return a.confidence > b.confidence;
  });
  std::size_t right = 0;
  std::size_t found = 0;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    right += loops[i].right ? 1 : 0;
    found += loops[i].right && loops[i].positive ? 1 : 0;
    // No threshold separates equal confidences.
    if (i + 1 < loops.size() && loops[i + 1].confidence == loops[i].confidence) continue;
    curve.push_back({loops[i].confidence, static_cast<double>(right) / static_cast<double>(i + 1),
                     static_cast<double>(found) / static_cast<double>(positives)});
  }
  return curve;
}

LoopScore score_loops(std::span<const TrueKeyframe> queries,
                      std::span<const TrueKeyframe> references, std::span<const LoopRecord> loops,
                      const LoopScoreConfig& config) {
  LoopScore score;
  score.queries = queries.size();
  const bool views_known = config.common_view.size() == queries.size() * references.size();
  std::vector<Query> scored(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    scored[i].positive = has_revisit(queries[i], references, config);
    score.positives += scored[i].positive ? 1 : 0;
    scored[i].shares_view = views_known && has_common_view(i, queries, references, config);
    score.view_positives += scored[i].shares_view ? 1 : 0;
  }
  const auto query_index = index_by_keyframe(queries);
  const auto reference_index = index_by_keyframe(references);
  for (const LoopRecord& loop : loops) {
    const auto query = query_index.find(loop.query_keyframe);
    const auto match = reference_index.find(loop.match_keyframe);
    if (query == query_index.end() || match == reference_index.end() ||
        !eligible(queries[query->second], references[match->second], config)) {
      ++score.loops_left_out;
      continue;
    }
    ++score.loops;
    const ScoredLoop errors =
        score_loop(loop, queries[query->second], references[match->second], config);
    keep_better(scored[query->second].best, errors);
    if (loop.accepted) keep_better(scored[query->second].accepted, errors);
  }
  score.by_distance = figures(scored, {&Query::positive, &ScoredLoop::true_by_distance});
  score.by_pose = figures(scored, {&Query::positive, &ScoredLoop::true_by_pose});
  score.by_view = figures(scored, {&Query::shares_view, &ScoredLoop::true_by_pose});
  std::vector<double> translations;
  std::vector<double> rotations;
  for (const Query& query : scored) {
    if (!query.accepted || !query.accepted->true_by_distance) continue;
    translations.push_back(query.accepted->translation_error_m);
    rotations.push_back(query.accepted->rotation_error_deg);
  }
  score.translation_error_m = statistics(std::move(translations));
  score.rotation_error_deg = statistics(std::move(rotations));
  return score;
}

}  // namespace unimapper::evaluate
