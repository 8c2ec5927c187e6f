// Base of all dataset formats: association of files with poses and stamps.
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
};

/// Sequences without times are taken at 10 Hz.
inline constexpr std::int64_t kDefaultPeriod_ns = 100'000'000;

/// For each file the index of its line in a file of `lines` lines: its position in the order
/// of names if there are as many lines as files; the number in its name if there are more
/// lines (an excerpt of a longer sequence). Throws DatasetError naming `text_file` if it has
/// fewer lines or the names hold no number.
std::vector<std::size_t> match_lines(const std::vector<std::filesystem::path>& files,
                                     std::size_t lines, const std::filesystem::path& text_file,
                                     const std::string& what);

/// Gives `files` the poses of `trajectory` (read from `poses_file`). Stamps come from
/// `times_file` if it exists, else from the trajectory, else every 0.1 s. Throws DatasetError.
Sequence make_sequence(std::vector<std::filesystem::path> files, const Trajectory& trajectory,
                       const std::filesystem::path& poses_file,
                       const std::filesystem::path& times_file);

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
