// Runner of the command-line tool, and small recordings for it.
#pragma once

#include <sys/types.h>

#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "tests/temporary_directory.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::apps {

using Words = std::vector<std::string>;

/// What the tool said and how it ended.
struct CommandResult {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// Starts `program ARGUMENTS...` with that output, no shell in between that could change them.
pid_t start(const char* program, const Words& arguments, int out, int err);

/// Runs `unimapper ARGUMENTS... MORE...`.
CommandResult run_unimapper(const Words& arguments, const Words& more = {});
/// The same for what must succeed.
CommandResult run_well(const Words& arguments, const Words& more = {});

/// Checks the exit code and the message of a command that failed.
void check_fails(const CommandResult& result, const std::string& message, int exit_code = 1);

std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);
/// The numbers of each line.
std::vector<std::vector<double>> read_rows(const std::filesystem::path& file);

/// A drive at 1 m per scan along a street with walls on both sides.
struct SmallRecording {
  std::vector<datasets::Scan> scans;
  std::vector<Pose> poses;
  std::vector<std::int64_t> stamps_ns;

  explicit SmallRecording(std::size_t count = 12);
  /// Writes it in KITTI form: scans/, poses.txt, times.txt.
  void write(const std::filesystem::path& directory) const;
};

/// A run of a recording with a VLP-16, whose pipeline needs little memory: NAME in the directory,
/// its data in NAME-data beside it.
std::string make_run(const TemporaryDirectory& directory, const std::string& name,
                     const SmallRecording& recording, const Words& more = {});
std::string make_run(const TemporaryDirectory& directory, const std::string& name,
                     std::size_t scans);

/// Labels of two runs on the same points.
struct LabelPairs {
  std::size_t all = 0;
  std::size_t equal = 0;
  std::size_t dynamic = 0;  ///< in the first run
};
LabelPairs label_pairs(const std::filesystem::path& first, const std::filesystem::path& second);

}  // namespace unimapper::apps
