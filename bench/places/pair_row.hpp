// Retrieval metrics of one pair of drives: a row of the tables.
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "bench/places/drive.hpp"
#include "src/core/loop_record.hpp"
#include "src/evaluate/loops.hpp"

namespace unimapper::bench {

/// Combination of LiDARs; narrow: a field of view in one direction only. "same LiDAR", "wide-wide",
/// "wide-narrow" or "narrow-narrow".
[[nodiscard]] const char* group_of(const std::string& sensor_a, const std::string& sensor_b);

/// Candidates for the keyframes of a query drive in a reference drive.
struct Retrieval {
  std::vector<LoopRecord> loops;  ///< poses are between levelled keyframe frames
  std::vector<double> search_ms;  ///< of every query, processor time
};

/// Searches every place of `queries` among those of `references` with `PlaceDatabase`.
[[nodiscard]] Retrieval search_database(const Drive& references, const Drive& queries);
/// The same with STD. Drives without STD descriptors give no candidates.
[[nodiscard]] Retrieval search_std(const Drive& references, const Drive& queries);

struct PairRow {
  std::string database;  ///< LiDAR
  std::string queries;   ///< LiDAR
  std::string route;     ///< of the queries
  const char* group = "";
  std::size_t positives = 0;  ///< queries with a reference within the distance
  evaluate::LoopFigures by_distance;
  evaluate::LoopFigures by_pose;
  double error_m = 0.0;  ///< median of accepted candidates that are true by distance
  double error_deg = 0.0;
  double describe_ms = 0.0;  ///< median of the queries
  double search_ms = 0.0;
};

/// Scores the candidates; positives are within `near_m`.
[[nodiscard]] PairRow score_pair(const Drive& references, const Drive& queries,
                                 const Retrieval& retrieval, double near_m);

/// Markdown: a line per row, and below it one per route and group with means of figures and sums of
/// counts. Figures of rows without positives are left out of the means.
void print_rows(std::ostream& out, const std::string& title, const std::vector<PairRow>& rows);

}  // namespace unimapper::bench
