#include "src/apps/merge/run_positions.hpp"

#include <algorithm>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "ports/datasets/files.hpp"
#include "src/apps/map/known_positions.hpp"

namespace unimapper::apps {

namespace fs = std::filesystem;

std::vector<fs::path> position_files(const std::vector<fs::path>& runs) {
  std::set<fs::path> files;
  for (const fs::path& run : runs) {
    std::error_code error;
    if (!run.empty() && fs::exists(run / kPositionsFile, error)) files.insert(run / kPositionsFile);
  }
  return {files.begin(), files.end()};
}

std::vector<merge::KnownPosition> positions_of_runs(const std::vector<SessionData>& sessions,
                                                    const std::vector<fs::path>& runs,
                                                    const Projection& system) {
  std::vector<merge::KnownPosition> positions;
  for (const fs::path& file : position_files(runs)) {
    const std::vector<PositionRow> rows =
        parse_positions(datasets::read_file(file), file.string(), std::nullopt,
                        [&](const Datum& place) { return system.project(place); });
    const bool has_keyframes =
        std::any_of(rows.begin(), rows.end(), [](const auto& row) { return row.sequence; });
    const auto sessions_of_run = std::count_if(runs.begin(), runs.end(), [&](const fs::path& run) {
      return run / kPositionsFile == file;
    });
    if (has_keyframes && sessions_of_run > 1) {
      throw std::runtime_error(file.string() + ": the run has " + std::to_string(sessions_of_run) +
                               " sessions, each with such keyframes: name stamps instead");
    }
    for (std::uint32_t s = 0; s < sessions.size(); ++s) {
      if (runs[s] / kPositionsFile != file) continue;
      const auto assigned =
          assign_positions(sessions[s], rows, Eigen::Vector3d::Zero(), file.string());
      const auto& keyframes = sessions[s].keyframes;
      for (std::uint32_t k = 0; k < keyframes.size(); ++k) {
        for (const store::StoredPosition& position : assigned.positions) {
          if (position.sequence != keyframes[k].sequence) continue;
          positions.push_back(known_position({s, k}, keyframes[k], position));
        }
      }
    }
  }
  if (positions.empty()) {
    throw std::runtime_error(
        "--crs: no position is known that places the map in " + system.system().name +
        "; `unimapper onboard` writes those of a bag's receiver (sensor_msgs/NavSatFix) into "
        "RUN/positions.csv, `unimapper map position` takes surveyed ones");
  }
  return positions;
}

void report_positions(const merge::MergeResult& result, const std::vector<SessionData>& sessions) {
  constexpr std::size_t kMostNamed = 10;
  std::size_t unused = 0;
  std::map<std::string, std::size_t> reasons;
  for (const merge::PositionOutcome& position : result.positions) {
    if (position.used) continue;
    ++reasons[position.reason];
    if (++unused > kMostNamed) continue;
    const KeyframeId keyframe = position.given.keyframe;
    const SessionData& session = sessions[keyframe.session];
    std::cerr << "unimapper: warning: position of " << session.info.name << ':'
              << session.keyframes[keyframe.keyframe].sequence << " not used: " << position.reason
              << '\n';
  }
  if (result.positions.empty()) return;
  std::cerr << "unimapper: " << result.positions.size() - unused << " of "
            << result.positions.size() << " known positions used";
  for (const auto& [reason, count] : reasons) std::cerr << "; " << count << ": " << reason;
  std::cerr << '\n';
}

}  // namespace unimapper::apps
