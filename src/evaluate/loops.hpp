// Precision and recall of loop search (paper section VII-B).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "src/core/loop_record.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::evaluate {

/// Ground truth of a keyframe.
struct TrueKeyframe {
  std::uint32_t keyframe = 0;  ///< running number in its session
  std::uint32_t scan = 0;      ///< index of its reference scan
  Pose T_world_sensor;         ///< ground truth at the reference scan
};

/// What counts as a revisit and as a true pose.
struct LoopScoreConfig {
  double threshold_m = 10.0;        ///< a revisit is at most this far away
  double pose_translation_m = 2.0;  ///< `_pose`: largest error of the reported translation
  double pose_rotation_deg = 5.0;   ///< `_pose`: largest error of the reported rotation
  /// Queries and references are one session: a match must lie at least `min_gap_keyframes`
  /// earlier. False: any reference may match.
  bool same_session = true;
  std::uint32_t min_gap_keyframes = 50;  ///< from a query to the nearest reference that may match
  /// Queries x references, row by row: 1 if both show the same structure. LiDARs that look in one
  /// direction may stand side by side and see nothing in common, or see the same from afar. Empty:
  /// not known, and `by_view` stays empty.
  std::span<const std::uint8_t> common_view;
};

/// Precision and recall; NaN where the denominator is zero.
struct PrecisionRecall {
  /// True positives per accepted loop.
  double precision = std::numeric_limits<double>::quiet_NaN();
  /// True positives per query with a true revisit.
  double recall = std::numeric_limits<double>::quiet_NaN();
  double f1 = std::numeric_limits<double>::quiet_NaN();  ///< harmonic mean of both
  std::size_t true_positives = 0;                        ///< accepted and right
  std::size_t false_positives = 0;                       ///< accepted and wrong
  std::size_t false_negatives = 0;                       ///< true revisits that were not found
};

/// One threshold of the sweep: every query's best loop of at least this confidence counts as
/// accepted.
struct CurvePoint {
  double confidence = 0.0;  ///< the threshold
  double precision = 0.0;   ///< at this threshold
  double recall = 0.0;      ///< at this threshold
};

/// The most confident loop of one query, under one definition of a true match.
struct RankedLoop {
  double confidence = 0.0;  ///< as reported
  bool right = false;       ///< a true match
  bool positive = false;    ///< the query has a true match to find
};

/// Precision and recall over falling confidence; `positives` counts all queries with a true match,
/// those without a loop included. Empty if there are none. O(n log n).
[[nodiscard]] std::vector<CurvePoint> precision_recall_curve(std::vector<RankedLoop> loops,
                                                             std::size_t positives);

/// Figures under one definition of a true match.
struct LoopFigures {
  PrecisionRecall operating_point;  ///< what the run itself accepted
  std::vector<CurvePoint> curve;    ///< falling confidence, rising recall
  double f1_max = 0.0;              ///< largest F1 on the curve
  /// Area under the curve: trapezoids over recall, the first point's precision held from
  /// recall 0.
  double auc = 0.0;
  double recall_at_full_precision = 0.0;  ///< largest recall before the first false match
};

/// Counts and curves of all loops scored.
struct LoopScore {
  std::size_t queries = 0;         ///< keyframes searched for
  std::size_t positives = 0;       ///< queries with a true revisit to find
  std::size_t loops = 0;           ///< scored: of the queries, against eligible references
  std::size_t loops_left_out = 0;  ///< of an unknown keyframe, or of one nearer than the gap
  std::size_t view_positives = 0;  ///< queries with a reference that shows the same structure
  LoopFigures by_distance;         ///< true match: within `threshold_m`
  LoopFigures by_pose;             ///< true match: the reported pose is right
  LoopFigures by_view;             ///< right poses, of the queries with a common view
  /// Errors of the reported poses of accepted matches that are true by distance.
  ErrorStatistics translation_error_m;
  ErrorStatistics rotation_error_deg;  ///< degrees, of the same matches
};

/// Scores `loops`, by their keyframes' numbers: the caller has chosen the rows of the two sessions.
/// A query is positive when an eligible reference lies within the threshold. One loop per query
/// counts: the most confident accepted one at the operating point, the most confident of all in the
/// sweep. A loop is true by distance when its keyframes are within the threshold, true by pose when
/// its reported pose is right, however far apart the keyframes are. `by_view` takes the same loops
/// as true as by pose, but a query is positive when a reference has a common view with it. A false
/// loop of a positive query is a false positive and a missed revisit; a true loop of a query that
/// is not positive counts for precision alone. O(queries x references).
[[nodiscard]] LoopScore score_loops(std::span<const TrueKeyframe> queries,
                                    std::span<const TrueKeyframe> references,
                                    std::span<const LoopRecord> loops,
                                    const LoopScoreConfig& config);

}  // namespace unimapper::evaluate
