// Base of all formats of several files: association of files with poses and stamps.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/poses.hpp"

namespace unimapper::datasets {

/// Files in order of time with one pose and one stamp each.
struct Sequence {
  std::vector<std::filesystem::path> files;  ///< one per scan
  std::vector<Pose> poses;                   ///< T_world_sensor of each file
  std::vector<std::int64_t> stamps_ns;       ///< of each file
  std::vector<Note> notes;                   ///< how poses were found
  bool has_poses = true;                     ///< false: each is the identity
};

/// Sequences without times are taken at 10 Hz.
inline constexpr std::int64_t kDefaultPeriod_ns = 100'000'000;

/// For each file the index of its line in a file of `lines` lines: its position in the order of
/// names if there are as many lines as files. If there are more, the scans may be an excerpt of a
/// longer sequence and the numbers in their names its line numbers from 0: taken so where
/// `are_numbered_by_line` (the format says it), where the last number is the last line's, or where
/// the numbers begin beyond 1. Else poses at a higher rate would be taken for an excerpt. Throws
/// DatasetError naming `text_file` with the remedy.
std::vector<std::size_t> match_lines(const std::vector<std::filesystem::path>& files,
                                     std::size_t lines, const std::filesystem::path& text_file,
                                     const std::string& what, bool are_numbered_by_line = false);

/// What `make_sequence` associates.
struct SequenceParts {
  std::vector<std::filesystem::path> files;  ///< in natural order
  /// The poses, with or without stamps.
  const Trajectory& trajectory;
  std::filesystem::path poses_file;   ///< that it was read from
  std::filesystem::path times_file;   ///< one stamp a scan; need not exist
  bool are_numbered_by_line = false;  ///< see `match_lines`
};

/// Gives files stamps and poses. Stamps come from `times_file`, else from the names. Where scans
/// and poses both have stamps, poses are interpolated, and scans that no pose is near to are left
/// out with a note; else they are taken line by line. Scans without stamps have those of their
/// poses, else every 0.1 s. Throws DatasetError.
Sequence make_sequence(SequenceParts parts);

/// Poses of a folder of scans.
struct FolderPoses {
  Trajectory trajectory;     ///< one pose a scan, or with stamps
  bool are_recorded = true;  ///< false: an identity for each scan
};

/// Reads `poses_file`. Identities for `scans` scans where there is no such file and the user named
/// none, or where `options` ask for the own odometry. Throws DatasetError.
FolderPoses read_folder_poses(const std::filesystem::path& poses_file, std::size_t scans,
                              const OpenOptions& options);

/// The part of it for scans and poses that both have stamps.
Sequence take_by_stamp(const std::vector<std::filesystem::path>& files,
                       const std::vector<std::int64_t>& stamps_ns, const Trajectory& trajectory,
                       const std::filesystem::path& poses_file);

/// Base of the formats that hold a sequence in memory and read its scans on demand.
class SequenceDataset : public Dataset {
 public:
  [[nodiscard]] std::size_t scan_count() const override { return sequence_.files.size(); }
  [[nodiscard]] const Pose& pose(std::size_t i) const override { return sequence_.poses.at(i); }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override {
    return sequence_.stamps_ns.at(i);
  }
  [[nodiscard]] std::string scan_name(std::size_t i) const override {
    return sequence_.files.at(i).stem().string();
  }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return {}; }
  [[nodiscard]] std::vector<Note> notes() const override { return sequence_.notes; }
  [[nodiscard]] bool has_poses() const override { return sequence_.has_poses; }

 protected:
  explicit SequenceDataset(Sequence sequence) : sequence_(std::move(sequence)) {}
  /// File of scan `i`; throws std::out_of_range.
  [[nodiscard]] const std::filesystem::path& file(std::size_t i) const {
    return sequence_.files.at(i);
  }
  /// Files, poses and stamps of all scans.
  [[nodiscard]] const Sequence& sequence() const { return sequence_; }

 private:
  Sequence sequence_;
};

}  // namespace unimapper::datasets
