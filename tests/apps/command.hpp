// Runner of the command-line tool, and small recordings for it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "tests/temporary_directory.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::apps {

/// What the tool said and how it ended.
struct CommandResult {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// Runs `unimapper ARGUMENTS...`, no shell in between that could change them.
CommandResult run_unimapper(const std::vector<std::string>& arguments);

std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

/// A drive at 1 m per scan along a street with walls on both sides.
struct SmallRecording {
  std::vector<datasets::Scan> scans;
  std::vector<Pose> poses;
  std::vector<std::int64_t> stamps_ns;

  explicit SmallRecording(std::size_t count = 12);
  /// Writes it in KITTI form: scans/, poses.txt, times.txt.
  void write(const std::filesystem::path& directory) const;
};

/// A run of a small recording with a VLP-16, NAME in the directory, its data beside it. The tool
/// must succeed.
std::string make_run(const TemporaryDirectory& directory, const std::string& name,
                     std::size_t scans);

}  // namespace unimapper::apps
