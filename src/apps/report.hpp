// HTML report and terminal summary of a merge.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "src/apps/removal_score.hpp"
#include "src/apps/report/measured_load.hpp"
#include "src/apps/report/pair_quality.hpp"
#include "src/apps/truth.hpp"
#include "src/apps/view/map_files.hpp"
#include "unimapper/evaluate/trajectory.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Ground truth and measurements of one session. Everything is optional.
struct SessionReference {
  /// The session's run folder; stage times are read from its stats.json when that is there.
  std::filesystem::path run;
  /// Ground truth T_world_sensor (`read_truth`), sorted by stamp. All sessions' truths share one
  /// world.
  std::vector<evaluate::StampedPose> truth;
  std::optional<RemovalScore> removal;  ///< where true labels are known
};

/// Everything a report or a terminal summary shows. The pointers must outlive the call.
struct ReportInput {
  const std::vector<SessionData>* sessions = nullptr;
  const merge::MergeResult* result = nullptr;
  std::vector<SessionReference> references;  ///< one per session, or empty
  std::string title = "Merged map";
  std::vector<std::string> commands;   ///< shown under "how to reproduce", one a line
  double elapsed_s = 0.0;              ///< wall-clock time of the merge; 0 hides it
  std::optional<MeasuredLoad> load;    ///< of the machine during the merge
  std::vector<PairQuality> qualities;  ///< `pair_qualities`; empty hides them
};

/// Writes the page of the map (docs/page.md) to `path`, with tables and charts, and as many of the
/// map's points as keep it small: no network. Throws std::runtime_error naming `path` when it
/// cannot be written.
void write_report(const std::filesystem::path& path, const ReportInput& input,
                  const MapFiles& files);

/// The summary for a terminal: one line per session, the loops, the trajectory errors where
/// the truth is known. Ends with a newline.
[[nodiscard]] std::string summary_table(const ReportInput& input);

}  // namespace unimapper::apps
