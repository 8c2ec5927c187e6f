// Retrieval metrics of one pair of drives: a row of the tables.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/places/retrieval.hpp"
#include "bench/places/scene.hpp"
#include "unimapper/evaluate/loops.hpp"

namespace unimapper::bench {

/// Combination of LiDARs.
enum class PairGroup : std::uint8_t { kSame, kWideWide, kWideNarrow, kNarrowNarrow };
inline constexpr std::array kPairGroups = {PairGroup::kSame, PairGroup::kWideWide,
                                           PairGroup::kWideNarrow, PairGroup::kNarrowNarrow};

[[nodiscard]] const char* name_of(PairGroup group);
/// Narrow: a field of view in one direction only.
[[nodiscard]] PairGroup group_of(const std::string& sensor_a, const std::string& sensor_b);

struct RowConfig {
  double near_m = 10.0;       ///< positives by distance
  double paper_m = 35.0;      ///< d_th of the paper
  double common_view = 0.30;  ///< positives by view: share of the smaller one's structure
};

/// Two drives and the common view of their keyframes.
struct DrivePair {
  std::string scene;
  const SceneDrive* references = nullptr;
  const SceneDrive* queries = nullptr;
  std::vector<float> view;  ///< common view, queries x references, row by row

  [[nodiscard]] double view_of(std::size_t query, std::size_t reference) const;
  /// The reference with the largest common view.
  [[nodiscard]] std::size_t best_view(std::size_t query) const;
};

/// Computes `view`. O(queries x references x voxels).
void fill_view(DrivePair& pair);

/// The top candidate of one query.
struct TopCandidate {
  std::size_t query = 0;
  bool answered = false;
  std::size_t match = 0;  ///< or `kDistractor`
  double confidence = 0.0;
  bool accepted = false;
  bool right = false;  ///< by pose
  double error_m = 0.0;
  double error_deg = 0.0;
  Pose T_match_query;  ///< estimated, between levelled keyframe frames
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
  std::size_t loops_at_full_precision = 0;  ///< right candidates above the first wrong one
  double full_precision_from = 0.0;         ///< their lowest confidence; 2 if there are none
  double error_m = 0.0;                     ///< median of accepted candidates
  double error_deg = 0.0;
  double repeatability = 0.0;         ///< 0.5 m
  double repeatability_narrow = 0.0;  ///< 0.3 m
  double describe_ms = 0.0;
  double search_ms = 0.0;
  std::size_t triangles = 0;      ///< stored triangles (STD only)
  std::vector<TopCandidate> top;  ///< of every query
  /// True positions of the keyframes, x and y.
  std::vector<Eigen::Vector2d> reference_track;
  std::vector<Eigen::Vector2d> query_track;
};

/// Scores candidates; leaves repeatability and the cost of description to the caller.
[[nodiscard]] PairRow score_pair(const DrivePair& pair, const RetrievalResult& retrieval,
                                 const RowConfig& config);

/// A row of our database, and one of STD.
[[nodiscard]] PairRow database_row(const DrivePair& pair, const Variant& variant,
                                   const DistractorPlaces& distractors, const RowConfig& config);
[[nodiscard]] PairRow std_row(const DrivePair& pair, const RowConfig& config);

}  // namespace unimapper::bench
