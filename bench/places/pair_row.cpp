#include "bench/places/pair_row.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <span>

#include "src/core/quantile.hpp"
#include "src/merge/in_arena.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/place/database.hpp"

namespace unimapper::bench {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t kReferenceSession = 1;
constexpr std::uint32_t kQuerySession = 2;

using Rows = std::vector<const PairRow*>;

LoopRecord loop_of(const PlaceKeyframe& query, const PlaceKeyframe& match, double confidence,
                   bool accepted, const Pose& T_match_query) {
  LoopRecord loop;
  loop.query_keyframe = query.sequence;
  loop.match_keyframe = match.sequence;
  loop.confidence = confidence;
  loop.accepted = accepted;
  loop.T_match_query = T_match_query;
  return loop;
}

std::vector<evaluate::TrueKeyframe> truth_of(const Drive& drive) {
  std::vector<evaluate::TrueKeyframe> truth;
  for (const PlaceKeyframe& keyframe : drive.keyframes) {
    truth.push_back({keyframe.sequence, keyframe.scan, keyframe.T_world_keyframe});
  }
  return truth;
}

double median_of(std::vector<double> values) {
  return values.empty() ? kNone : median(std::span(values));
}

std::string number(double value, int digits) {
  if (std::isnan(value)) return "–";
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

/// Mean of `figure(row)` where it is a number.
template <typename Figure>
std::string mean(const Rows& rows, int digits, const Figure& figure) {
  double sum = 0.0;
  double count = 0.0;
  for (const PairRow* row : rows) {
    const double value = figure(*row);
    if (std::isnan(value)) continue;
    sum += value;
    count += 1.0;
  }
  return number(count > 0.0 ? sum / count : kNone, digits);
}

std::string figures(const Rows& rows, evaluate::LoopFigures PairRow::*by) {
  const auto part = [&](double evaluate::LoopFigures::*figure) {
    return mean(rows, 3,
                [&](const PairRow& row) { return row.positives > 0 ? (row.*by).*figure : kNone; });
  };
  return part(&evaluate::LoopFigures::f1_max) + " / " + part(&evaluate::LoopFigures::auc) + " / " +
         part(&evaluate::LoopFigures::recall_at_full_precision);
}

/// The columns of one row, or of several together.
std::string columns(const Rows& rows) {
  std::size_t positives = 0;
  std::size_t right = 0;
  std::size_t wrong = 0;
  for (const PairRow* row : rows) {
    positives += row->positives;
    right += row->by_pose.operating_point.true_positives;
    wrong += row->by_pose.operating_point.false_positives;
  }
  const auto average = [&](double PairRow::*figure, int digits) {
    return mean(rows, digits, [&](const PairRow& row) { return row.*figure; });
  };
  return " " + std::to_string(positives) + " | " + figures(rows, &PairRow::by_pose) + " | " +
         figures(rows, &PairRow::by_distance) + " | " + std::to_string(right) + " / " +
         std::to_string(wrong) + " | " + average(&PairRow::error_m, 3) + " / " +
         average(&PairRow::error_deg, 2) + " | " + average(&PairRow::describe_ms, 2) + " / " +
         average(&PairRow::search_ms, 2) + " |\n";
}

bool is_narrow(const std::string& sensor) {
  return sensor == "aeva-aeries2" || sensor == "livox-avia";
}

}  // namespace

const char* group_of(const std::string& sensor_a, const std::string& sensor_b) {
  if (sensor_a == sensor_b) return "same LiDAR";
  if (is_narrow(sensor_a) != is_narrow(sensor_b)) return "wide-narrow";
  return is_narrow(sensor_a) ? "narrow-narrow" : "wide-wide";
}

Retrieval search_database(const Drive& references, const Drive& queries) {
  PipelineConfig config;
  config.loop_search.max_places = std::max(config.loop_search.max_places,
                                           static_cast<std::uint32_t>(references.keyframes.size()));
  merge::InArena<PlaceDatabase> database(config.loop_search, config.place_shape());
  for (std::uint32_t i = 0; i < references.keyframes.size(); ++i) {
    const PlaceKeyframe& keyframe = references.keyframes[i];
    database->insert(keyframe.place(), {kReferenceSession, i}, keyframe.T_odometry_keyframe);
  }
  Retrieval result;
  for (std::uint32_t i = 0; i < queries.keyframes.size(); ++i) {
    const double start = thread_milliseconds();
    const auto found = database->search(queries.keyframes[i].place(), {kQuerySession, i},
                                        {SearchScope::Sessions::kOnlyOther, 0});
    result.search_ms.push_back(thread_milliseconds() - start);
    for (const LoopCandidate& candidate : found) {
      result.loops.push_back(loop_of(
          queries.keyframes[i], references.keyframes[candidate.match.keyframe],
          static_cast<double>(candidate.confidence), candidate.accepted, candidate.T_match_query));
    }
  }
  return result;
}

Retrieval search_std(const Drive& references, const Drive& queries) {
  StdDatabase database;
  for (const StdPlace& place : references.std_places) database.insert(place);
  Retrieval result;
  for (std::size_t i = 0; i < queries.std_places.size(); ++i) {
    const auto found = database.search(queries.std_places[i]);
    if (!found) continue;
    // STD's places are in the frames of the two odometries.
    const PlaceKeyframe& query = queries.keyframes[i];
    const PlaceKeyframe& match = references.keyframes[found->match];
    result.loops.push_back(loop_of(
        query, match, found->score, found->score >= StdConfig::kAcceptScore,
        match.T_odometry_keyframe.inverse() * found->T_match_query * query.T_odometry_keyframe));
  }
  return result;
}

PairRow score_pair(const Drive& references, const Drive& queries, const Retrieval& retrieval,
                   double near_m) {
  evaluate::LoopScoreConfig config;
  config.threshold_m = near_m;
  config.same_session = false;
  const evaluate::LoopScore score =
      evaluate::score_loops(truth_of(queries), truth_of(references), retrieval.loops, config);
  PairRow row;
  row.database = references.sensor;
  row.queries = queries.sensor;
  row.route = queries.route;
  row.group = group_of(row.database, row.queries);
  row.positives = score.positives;
  row.by_distance = score.by_distance;
  row.by_pose = score.by_pose;
  const bool none = score.translation_error_m.count == 0;
  row.error_m = none ? kNone : score.translation_error_m.median;
  row.error_deg = none ? kNone : score.rotation_error_deg.median;
  std::vector<double> describe_ms;
  for (const PlaceKeyframe& keyframe : queries.keyframes) {
    describe_ms.push_back(keyframe.describe_ms);
  }
  row.search_ms = median_of(retrieval.search_ms);
  row.describe_ms = retrieval.search_ms.empty() ? kNone : median_of(describe_ms);
  return row;
}

void print_rows(std::ostream& out, const std::string& title, const std::vector<PairRow>& rows) {
  const char* const kTitles =
      " positives | by pose: F1 / AUC / R at P = 1 | by distance | accepted right / wrong | error "
      "m / deg | ms describe / search |\n|---|---|---|---|---|---|---|---|---|\n";
  out << "\n| " << title << ": database | queries | route |" << kTitles;
  std::set<std::string> routes;
  for (const PairRow& row : rows) {
    out << "| " << row.database << " | " << row.queries << " | " << row.route << " |"
        << columns({&row});
    routes.insert(row.route);
  }
  out << "\n| " << title << ", mean (counts: sum) | rows | route |" << kTitles;
  for (const std::string& route : routes) {
    for (const std::string group : {"same LiDAR", "wide-wide", "wide-narrow", "narrow-narrow"}) {
      Rows chosen;
      for (const PairRow& row : rows) {
        if (row.route == route && row.group == group) chosen.push_back(&row);
      }
      if (chosen.empty()) continue;
      out << "| " << group << " | " << chosen.size() << " | " << route << " |" << columns(chosen);
    }
  }
}

}  // namespace unimapper::bench
