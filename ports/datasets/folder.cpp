// Reader of a folder of scans in any common file format.
#include <algorithm>
#include <array>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/pcd.hpp"
#include "ports/datasets/pcd_sequence.hpp"
#include "ports/datasets/ply.hpp"
#include "ports/datasets/record_width.hpp"
#include "ports/datasets/sequence.hpp"
#include "ports/datasets/text_encoding.hpp"
#include "ports/datasets/xyz.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 7> kExtensions = {".pcd", ".ply", ".bin", ".xyz",
                                                         ".asc", ".txt", ".csv"};

/// Scans and their folder.
struct FoundScans {
  fs::path folder;
  std::vector<fs::path> files;
};

/// Poses, times and notes lie beside scans and are text, too.
bool is_scan(const fs::path& file) {
  const std::string stem = stem_of(file);
  const std::string lower = lower_case(stem);
  for (const std::string_view other :
       {"gt_", "pose", "odom", "traj", "time", "calib", "label", "optimized"}) {
    if (lower.starts_with(other)) return false;
  }
  return !number_in_name(stem).digits.empty();
}

std::vector<fs::path> scans_in(const fs::path& folder) {
  for (const std::string_view extension : kExtensions) {
    std::vector<fs::path> files = list_files(folder, extension);
    std::erase_if(files, [](const fs::path& file) { return !is_scan(file); });
    if (!files.empty()) return files;
  }
  return {};
}

FoundScans find_scans(const fs::path& directory) {
  std::error_code error;
  if (!fs::is_directory(directory, error)) return {};
  const fs::path below =
      find_child(directory, {"scans", "pcd", "pcds", "ply", "clouds", "pointclouds", "keyframes",
                             "velodyne", "lidar", "points", "xyz", "bin"});
  for (const fs::path& folder : {below, directory}) {
    if (folder.empty() || !fs::is_directory(folder, error)) continue;
    std::vector<fs::path> files = scans_in(folder);
    if (!files.empty()) return {folder, std::move(files)};
  }
  return {};
}

class FolderDataset : public SequenceDataset {
 public:
  FolderDataset(Sequence sequence, RecordLayout layout)
      : SequenceDataset(std::move(sequence)), layout_(std::move(layout)) {}

  void read_scan(std::size_t i, Scan& scan) const override {
    std::string bytes = read_file(file(i));
    const std::string extension = lower_case(file(i).extension().string());
    if (extension == ".pcd") {
      parse_pcd(bytes, file(i), scan);
    } else if (extension == ".ply") {
      parse_ply(bytes, file(i), scan);
    } else if (extension == ".bin") {
      decode_records(bytes, layout_, scan);
    } else {
      parse_xyz(plain_text(std::move(bytes)), file(i), scan);
    }
  }

 private:
  RecordLayout layout_;
};

/// The poses the user names, those in the folder, or those beside its scans; empty without any.
fs::path find_poses(const fs::path& directory, const fs::path& scans, const OpenOptions& options) {
  if (!options.poses.empty()) return options.poses;
  for (const fs::path& folder :
       {directory, scans, fs::absolute(directory / "").parent_path().parent_path()}) {
    fs::path found = find_poses_file(folder);
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace

bool recognises_folder(const fs::path& directory) { return !find_scans(directory).files.empty(); }

std::unique_ptr<Dataset> open_folder(const fs::path& directory, const OpenOptions& options) {
  FoundScans scans = find_scans(directory);
  if (scans.files.empty()) {
    fail(directory,
         "holds no scans *.pcd, *.ply, *.bin, *.xyz, *.asc, *.txt or *.csv with a "
         "number in their name");
  }
  std::vector<Note> notes;
  RecordLayout layout;
  if (lower_case(scans.files.front().extension().string()) == ".bin") {
    layout = find_record_layout(scans.files, options.point_fields, notes);
  }
  const fs::path poses_file = find_poses(directory, scans.folder, options);
  const auto [trajectory, are_recorded] =
      read_folder_poses(poses_file, scans.files.size(), options);
  fs::path times = find_child(directory, {"times.txt", "timestamps.txt"});
  if (times.empty()) times = find_child(scans.folder, {"times.txt", "timestamps.txt"});
  Sequence sequence = make_sequence({.files = std::move(scans.files),
                                     .trajectory = trajectory,
                                     .poses_file = poses_file,
                                     .times_file = times,
                                     .are_numbered_by_line = !are_recorded});
  sequence.has_poses = are_recorded;
  sequence.notes.insert(sequence.notes.begin(), notes.begin(), notes.end());
  return std::make_unique<FolderDataset>(std::move(sequence), std::move(layout));
}

}  // namespace unimapper::datasets
