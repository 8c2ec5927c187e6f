// Evaluations behind `unimapper evaluate`: options in, JSON out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/apps/evaluate/map_alignment.hpp"
#include "src/apps/removal_score.hpp"
#include "src/evaluate/dynamic.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::apps {

/// Options of `evaluate dynamic`.
struct EvaluateDynamicOptions {
  std::filesystem::path truth;  ///< dataset with labels
  std::filesystem::path run;    ///< folder written by `unimapper onboard`
  datasets::OpenOptions input{};
  float neighbour_m = 0.05F;
  float max_range_m = 50.0F;
  std::size_t scans = SIZE_MAX;      ///< only the first ones
  std::filesystem::path pictures{};  ///< folder for pictures; empty: none
  bool replaces = false;             ///< overwrite earlier pictures
  std::size_t worst = 10;            ///< frames with pictures of their own
};

/// Options of `evaluate breakdown`.
struct EvaluateBreakdownOptions {
  std::vector<std::filesystem::path> results;  ///< of `evaluate dynamic`; none: the table's header
  std::string by = "class";                    ///< "class" or "range"
  std::string label;                           ///< first cell of the row
};

/// Options of `evaluate loops`.
struct EvaluateLoopsOptions {
  std::filesystem::path run;
  std::filesystem::path truth;
  std::filesystem::path against;        ///< empty: loops within the run
  std::filesystem::path against_truth;  ///< required with `against`
  double threshold_m = 10.0;
  /// Within the run only; by default the gap that robots search with.
  std::uint32_t min_gap_keyframes = PipelineConfig{}.search_scope.min_keyframe_gap;
  bool curve = false;  ///< the precision-recall curve too
};

/// Options of `evaluate trajectory`.
struct EvaluateTrajectoryOptions {
  std::filesystem::path map;
  SessionTruths truths;
};

/// Options of `evaluate changes`.
struct EvaluateChangesOptions {
  std::filesystem::path map;
  std::pair<std::string, std::filesystem::path> earlier;  ///< session, dataset
  std::pair<std::string, std::filesystem::path> later;
  double reach_m = 25.0;  ///< what was seen from farther away only does not count
};

/// Options of `evaluate view`.
struct EvaluateViewOptions {
  std::filesystem::path map;
  SessionTruths truths;
  SessionTruths runs{};  ///< sessions and folders with labels/
  /// One wrong point of each so large a voxel is shown; as large as those of maps.
  float voxel_m = merge::MapConfig{}.voxel_size_m;
  bool replaces = false;  ///< overwrite an earlier evaluation
};

/// Options of `evaluate map`.
struct EvaluateMapOptions {
  std::filesystem::path map;
  double tau_m = 5.0;
  double mme_radius_m = 1.0;
  std::size_t mme_min_neighbours = 10;
};

/// Each returns the JSON document of the contract, indented, with a final newline, and throws
/// std::runtime_error with a sentence for the user when the input does not fit together.
[[nodiscard]] std::string evaluate_dynamic(const EvaluateDynamicOptions& options);
[[nodiscard]] std::string evaluate_loops(const EvaluateLoopsOptions& options);
[[nodiscard]] std::string evaluate_trajectory(const EvaluateTrajectoryOptions& options);
[[nodiscard]] std::string evaluate_changes(const EvaluateChangesOptions& options);
[[nodiscard]] std::string evaluate_map(const EvaluateMapOptions& options);
/// Scores a map with its truth; returns and throws as `evaluate_dynamic` does. Writes
/// view/evaluation.json with its layers beside it, and the map's report.html anew.
[[nodiscard]] std::string evaluate_view(const EvaluateViewOptions& options);

/// One row of a Markdown table: the points of all results together, by class (DA, and DA of what
/// moved while it was seen) or by range (SA and DA). Throws std::runtime_error.
[[nodiscard]] std::string evaluate_breakdown(const EvaluateBreakdownOptions& options);

/// Per-point accuracy alone, for reports. Throws like `evaluate_dynamic`.
[[nodiscard]] RemovalScore score_run(const std::filesystem::path& truth,
                                     const std::filesystem::path& run);

}  // namespace unimapper::apps
