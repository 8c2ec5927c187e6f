// Output folder of a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "src/apps/onboard/write_failures.hpp"
#include "unimapper/core/point_view.hpp"

namespace unimapper::apps {

/// RUN/labels, RUN/final/labels, RUN/keyframes.lcmlog, RUN/loops.csv, RUN/stats.json, RUN/run.json,
/// RUN/events.log, and RUN/positions.csv of recordings with positions. Once the folder is there, a
/// file that cannot be written is counted and removed; the rest is not affected.
class RunFolder {
 public:
  /// Creates the folder, and removes an earlier run from it; `check_output_folder` says before
  /// whether that is wanted. Throws DatasetError.
  explicit RunFolder(const std::filesystem::path& directory);

  /// Name of the session: the folder's own, made safe for file names and tables.
  [[nodiscard]] const std::string& session_name() const { return session_name_; }
  [[nodiscard]] std::filesystem::path keyframe_log() const {
    return directory_ / "keyframes.lcmlog";
  }
  [[nodiscard]] std::filesystem::path event_log() const { return directory_ / "events.log"; }

  /// Writes RUN/labels/NAME.label: 251 for dynamic points, 9 for all others. Where `labels` is
  /// shorter than `points`, the rest is static.
  void write_labels(const std::string& name, std::span<const PointLabel> labels,
                    std::size_t points);
  /// Writes RUN/final/labels/NAME.label, final labels: 251 for dynamic points, 9 for all others.
  /// Where `labels` is shorter than `points`, the rest is static.
  void write_final_labels(const std::string& name, std::span<const PointLabel> labels,
                          std::size_t points);
  /// Writes RUN/NAME.
  void write_text(const std::string& name, const std::string& text);
  /// What could not be written, here and by others who write into the folder.
  [[nodiscard]] WriteFailures& failures() { return failures_; }

 private:
  /// Half a file would pass for a whole one.
  void write_whole(const std::filesystem::path& file, const std::function<void()>& write);
  void write(const std::filesystem::path& folder, const std::string& name,
             std::span<const PointLabel> labels, std::size_t points);

  std::filesystem::path directory_;
  std::string session_name_;
  std::vector<std::uint32_t> buffer_;
  WriteFailures failures_;
};

}  // namespace unimapper::apps
