// One drive looked for in another: the figures of a table's row.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/places/answers.hpp"
#include "bench/places/scene.hpp"
#include "unimapper/evaluate/loops.hpp"

namespace unimapper::bench {

/// Which LiDARs meet.
enum class PairGroup : std::uint8_t { kSame, kWideWide, kWideNarrow, kNarrowNarrow };
inline constexpr std::array kPairGroups = {PairGroup::kSame, PairGroup::kWideWide,
                                           PairGroup::kWideNarrow, PairGroup::kNarrowNarrow};

[[nodiscard]] const char* name_of(PairGroup group);
/// Narrow are those that look in one direction.
[[nodiscard]] PairGroup group_of(const std::string& sensor_a, const std::string& sensor_b);

struct RowConfig {
  double near_m = 10.0;       ///< positives by distance
  double paper_m = 35.0;      ///< d_th of the paper
  double common_view = 0.30;  ///< positives by view: so much of the smaller one's structure
};

/// Two drives and which of their keyframes show the same.
struct DrivePair {
  std::string scene;
  const SceneDrive* references = nullptr;
  const SceneDrive* queries = nullptr;
  std::vector<float> view;  ///< common view, queries x references, row by row

  [[nodiscard]] double view_of(std::size_t query, std::size_t reference) const;
  /// The reference that shows most of what a query shows.
  [[nodiscard]] std::size_t best_view(std::size_t query) const;
};

/// Works out `view`. O(queries x references x voxels).
void fill_view(DrivePair& pair);

/// The best answer to one query.
struct TopAnswer {
  std::size_t query = 0;
  bool answered = false;
  std::size_t match = 0;  ///< or `kStranger`
  double confidence = 0.0;
  bool accepted = false;
  bool right = false;  ///< by pose
  double error_m = 0.0;
  double error_deg = 0.0;
  Pose T_match_query;  ///< as answered, between levelled keyframe frames
  bool near = false;   ///< positive by distance
  bool view = false;   ///< positive by common view
  double nearest_m = 0.0;
  double best_view = 0.0;
};

struct PairRow {
  std::string scene;
  std::string reference_sensor;
  std::string query_sensor;
  std::string route;
  PairGroup group = PairGroup::kSame;
  std::size_t positives_near = 0;
  std::size_t positives_paper = 0;
  std::size_t positives_view = 0;
  evaluate::LoopFigures by_distance;
  evaluate::LoopFigures by_paper_distance;
  evaluate::LoopFigures by_pose;
  evaluate::LoopFigures by_view;
  std::size_t loops_at_full_precision = 0;  ///< right ones before the first wrong one
  double full_precision_from = 0.0;         ///< their lowest confidence; 2 if there are none
  double error_m = 0.0;                     ///< median of accepted answers
  double error_deg = 0.0;
  double repeatability = 0.0;         ///< 0.5 m
  double repeatability_narrow = 0.0;  ///< 0.3 m
  double describe_ms = 0.0;
  double search_ms = 0.0;
  std::size_t triangles = 0;   ///< STD: stored ones
  std::vector<TopAnswer> top;  ///< of every query
  /// Where the keyframes really were, seen from above.
  std::vector<Eigen::Vector2d> reference_track;
  std::vector<Eigen::Vector2d> query_track;
};

/// Scores answers; leaves repeatability and the cost of description to the caller.
[[nodiscard]] PairRow score_pair(const DrivePair& pair, const PlaceAnswers& answers,
                                 const RowConfig& config);

/// A row of our database, and one of STD.
[[nodiscard]] PairRow database_row(const DrivePair& pair, const Variant& variant,
                                   const Crowd& crowd, const RowConfig& config);
[[nodiscard]] PairRow std_row(const DrivePair& pair, const RowConfig& config);

}  // namespace unimapper::bench
