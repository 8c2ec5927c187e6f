#include "bench/places/pair_row.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/places/quantile.hpp"

namespace unimapper::bench {
namespace {

// Beyond this distance two keyframes share nothing that a descriptor could use.
constexpr double kFarthestView = 120.0;

bool is_narrow(const std::string& sensor) {
  return sensor == "aeva-aeries2" || sensor == "livox-avia";
}

double true_distance(const PlaceKeyframe& a, const PlaceKeyframe& b) {
  return (a.T_world_keyframe.translation - b.T_world_keyframe.translation).norm();
}

/// Stands for all distractors: a match with this keyframe is always wrong.
constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

evaluate::TrueKeyframe nowhere() {
  return {kNowhere, 0, {Eigen::Matrix3d::Identity(), {1e7, 1e7, 0.0}}};
}

/// Queries x references and, at the end of each row, nowhere.
std::vector<std::uint8_t> common_views(const DrivePair& pair, double common_view) {
  std::vector<std::uint8_t> common;
  for (std::size_t q = 0; q < pair.queries->drive.keyframes.size(); ++q) {
    for (std::size_t r = 0; r < pair.references->drive.keyframes.size(); ++r) {
      common.push_back(pair.view_of(q, r) >= common_view ? 1 : 0);
    }
    common.push_back(0);
  }
  return common;
}

evaluate::LoopScore score_answers(const DrivePair& pair, const RetrievalResult& retrieval,
                                  double threshold_m, std::span<const std::uint8_t> common_view) {
  const auto& queries = pair.queries->drive.keyframes;
  const auto& references = pair.references->drive.keyframes;
  std::vector<LoopRecord> loops;
  for (const RetrievedPlace& answer : retrieval.candidates) {
    const bool distractor = answer.match == kDistractor;
    LoopRecord& loop = loops.emplace_back();
    loop.query_keyframe = queries[answer.query].sequence;
    loop.match_keyframe = distractor ? kNowhere : references[answer.match].sequence;
    loop.confidence = answer.confidence;
    loop.accepted = answer.accepted;
    loop.T_match_query = answer.T_match_query;
  }
  evaluate::LoopScoreConfig config;
  config.threshold_m = threshold_m;
  config.same_session = false;
  config.common_view = common_view;
  auto known = true_keyframes(pair.references->drive);
  known.push_back(nowhere());
  return evaluate::score_loops(true_keyframes(pair.queries->drive), known, loops, config);
}

/// True matches of a query.
TopCandidate query_truth(const DrivePair& pair, std::size_t query, const RowConfig& config) {
  TopCandidate top;
  top.query = query;
  top.nearest_m = std::numeric_limits<double>::infinity();
  for (const PlaceKeyframe& reference : pair.references->drive.keyframes) {
    top.nearest_m =
        std::min(top.nearest_m, true_distance(reference, pair.queries->drive.keyframes[query]));
  }
  if (!pair.references->drive.keyframes.empty()) {
    top.best_view = pair.view_of(query, pair.best_view(query));
  }
  top.near = top.nearest_m <= config.near_m;
  top.view = top.best_view >= config.common_view;
  return top;
}

void set_candidate(const DrivePair& pair, const RetrievedPlace& answer, TopCandidate& top) {
  const Pose T_world_match = answer.match == kDistractor
                                 ? nowhere().T_world_sensor
                                 : pair.references->drive.keyframes[answer.match].T_world_keyframe;
  const Pose T_match_query =
      T_world_match.inverse() * pair.queries->drive.keyframes[answer.query].T_world_keyframe;
  const Pose error = T_match_query.inverse() * answer.T_match_query;
  const evaluate::LoopScoreConfig right;
  top.answered = true;
  top.match = answer.match;
  top.confidence = answer.confidence;
  top.accepted = answer.accepted;
  top.T_match_query = answer.T_match_query;
  top.error_m = error.translation.norm();
  top.error_deg = rotation_angle(error.rotation) * kDegreesPerRadian;
  top.right = top.error_m <= right.pose_translation_m && top.error_deg <= right.pose_rotation_deg;
}

std::vector<TopCandidate> top_candidates(const DrivePair& pair, const RetrievalResult& retrieval,
                                         const RowConfig& config) {
  std::vector<TopCandidate> top;
  for (std::size_t i = 0; i < pair.queries->drive.keyframes.size(); ++i) {
    top.push_back(query_truth(pair, i, config));
  }
  for (const RetrievedPlace& answer : retrieval.candidates) {
    TopCandidate& best = top[answer.query];
    if (!best.answered || answer.confidence > best.confidence) {
      set_candidate(pair, answer, best);
    }
  }
  return top;
}

void count_at_full_precision(PairRow& row) {
  double wrong_from = -1.0;
  for (const TopCandidate& top : row.top) {
    if (top.answered && !top.right) wrong_from = std::max(wrong_from, top.confidence);
  }
  row.full_precision_from = 2.0;
  for (const TopCandidate& top : row.top) {
    if (!top.answered || top.confidence <= wrong_from) continue;
    ++row.loops_at_full_precision;
    row.full_precision_from = std::min(row.full_precision_from, top.confidence);
  }
}

std::vector<Eigen::Vector2d> track_of(const Drive& drive) {
  std::vector<Eigen::Vector2d> track;
  for (const PlaceKeyframe& keyframe : drive.keyframes) {
    track.emplace_back(keyframe.T_world_keyframe.translation.head<2>());
  }
  return track;
}

using WorldPoints = std::vector<Eigen::Vector3d>;

WorldPoints keypoints_of(const SceneDrive& drive, std::size_t keyframe, std::size_t described_as) {
  const OwnedPlace& place = drive.described.at(described_as)[keyframe];
  const Pose T_world_place =
      drive.drive.keyframes[keyframe].T_world_keyframe * place.T_keyframe_place;
  WorldPoints points;
  for (const Keypoint& keypoint : place.keypoints) {
    points.emplace_back(T_world_place * Eigen::Vector3d(keypoint.position.cast<double>()));
  }
  return points;
}

WorldPoints std_keypoints_of(const SceneDrive& drive, std::size_t keyframe) {
  const PlaceKeyframe& at = drive.drive.keyframes[keyframe];
  const Pose T_world_odometry = at.T_world_keyframe * at.T_odometry_keyframe.inverse();
  WorldPoints points;
  for (const StdKeypoint& keypoint : drive.std_described[keyframe].place.keypoints) {
    points.emplace_back(T_world_odometry * keypoint.position);
  }
  return points;
}

/// Mean over the queries with a common view, each with the reference of the largest one.
template <typename KeypointsOf>
void measure_repeatability(const DrivePair& pair, const RowConfig& config,
                           const KeypointsOf& keypoints, PairRow& row) {
  std::vector<double> wide;
  std::vector<double> narrow;
  const SceneDrive& queries = *pair.queries;
  const SceneDrive& references = *pair.references;
  for (std::size_t i = 0; i < queries.drive.keyframes.size(); ++i) {
    if (references.drive.keyframes.empty()) break;
    const std::size_t j = pair.best_view(i);
    if (pair.view_of(i, j) < config.common_view) continue;
    const WorldPoints asked = keypoints(queries, i);
    const WorldPoints known = keypoints(references, j);
    wide.push_back(repeatability({asked, queries.columns[i]}, {known, references.columns[j]}, 0.5));
    narrow.push_back(repeatability({asked, queries.narrow_columns[i]},
                                   {known, references.narrow_columns[j]}, 0.3));
  }
  row.repeatability = mean(wide);
  row.repeatability_narrow = mean(narrow);
}

template <typename Described>
double median_cost(const std::vector<Described>& described) {
  std::vector<double> milliseconds;
  milliseconds.reserve(described.size());
  for (const auto& place : described) milliseconds.push_back(place.milliseconds);
  return median(std::move(milliseconds));
}

}  // namespace

const char* name_of(PairGroup group) {
  switch (group) {
    case PairGroup::kSame:
      return "same LiDAR";
    case PairGroup::kWideWide:
      return "wide-wide";
    case PairGroup::kWideNarrow:
      return "wide-narrow";
    case PairGroup::kNarrowNarrow:
      break;
  }
  return "narrow-narrow";
}

PairGroup group_of(const std::string& sensor_a, const std::string& sensor_b) {
  if (sensor_a == sensor_b) return PairGroup::kSame;
  if (is_narrow(sensor_a) != is_narrow(sensor_b)) return PairGroup::kWideNarrow;
  return is_narrow(sensor_a) ? PairGroup::kNarrowNarrow : PairGroup::kWideWide;
}

double DrivePair::view_of(std::size_t query, std::size_t reference) const {
  return static_cast<double>(view[query * references->drive.keyframes.size() + reference]);
}

std::size_t DrivePair::best_view(std::size_t query) const {
  const auto width = static_cast<std::ptrdiff_t>(references->drive.keyframes.size());
  const auto first = view.begin() + static_cast<std::ptrdiff_t>(query) * width;
  return static_cast<std::size_t>(std::max_element(first, first + width) - first);
}

void fill_view(DrivePair& pair) {
  const SceneDrive& queries = *pair.queries;
  const SceneDrive& references = *pair.references;
  pair.view.clear();
  for (std::size_t q = 0; q < queries.views.size(); ++q) {
    for (std::size_t r = 0; r < references.views.size(); ++r) {
      const double distance =
          true_distance(queries.drive.keyframes[q], references.drive.keyframes[r]);
      pair.view.push_back(distance < kFarthestView ? static_cast<float>(common_view(
                                                         queries.views[q], references.views[r]))
                                                   : 0.0F);
    }
  }
}

PairRow score_pair(const DrivePair& pair, const RetrievalResult& retrieval,
                   const RowConfig& config) {
  const auto common = common_views(pair, config.common_view);
  const auto near = score_answers(pair, retrieval, config.near_m, common);
  const auto paper = score_answers(pair, retrieval, config.paper_m, {});
  PairRow row;
  row.scene = pair.scene;
  row.reference_sensor = pair.references->sensor;
  row.query_sensor = pair.queries->sensor;
  row.route = pair.queries->route;
  row.group = group_of(row.reference_sensor, row.query_sensor);
  row.positives_near = near.positives;
  row.positives_paper = paper.positives;
  row.positives_view = near.view_positives;
  row.by_distance = near.by_distance;
  row.by_paper_distance = paper.by_distance;
  row.by_pose = near.by_pose;
  row.by_view = near.by_view;
  const bool none = near.translation_error_m.count == 0;
  row.error_m = none ? std::nan("") : near.translation_error_m.median;
  row.error_deg = none ? std::nan("") : near.rotation_error_deg.median;
  row.search_ms = median(retrieval.search_ms);
  row.triangles = retrieval.triangles;
  row.top = top_candidates(pair, retrieval, config);
  count_at_full_precision(row);
  row.reference_track = track_of(pair.references->drive);
  row.query_track = track_of(pair.queries->drive);
  return row;
}

PairRow database_row(const DrivePair& pair, const Variant& variant,
                     const DistractorPlaces& distractors, const RowConfig& config) {
  PairRow row = score_pair(
      pair, search_database(*pair.references, *pair.queries, variant, distractors), config);
  measure_repeatability(
      pair, config,
      [&](const SceneDrive& drive, std::size_t keyframe) {
        return keypoints_of(drive, keyframe, variant.described_as);
      },
      row);
  row.describe_ms = median_cost(pair.queries->described.at(variant.described_as));
  return row;
}

PairRow std_row(const DrivePair& pair, const RowConfig& config) {
  PairRow row = score_pair(pair, search_std(*pair.references, *pair.queries), config);
  measure_repeatability(pair, config, std_keypoints_of, row);
  row.describe_ms = median_cost(pair.queries->std_described);
  return row;
}

}  // namespace unimapper::bench
