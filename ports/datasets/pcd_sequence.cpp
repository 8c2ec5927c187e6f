#include "ports/datasets/pcd_sequence.hpp"

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/pcd.hpp"
#include "ports/datasets/sequence.hpp"
#include "ports/datasets/text_encoding.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

fs::path find_cloud_directory(const fs::path& directory) {
  return find_child(directory, {"scans", "pcd", "pcds", "clouds", "keyframes", "velodyne"});
}

fs::path find_poses_file(const fs::path& directory) {
  fs::path named =
      find_child(directory, {"optimized_poses.txt", "poses.txt", "poses_tum.txt", "poses_kitti.txt",
                             "tum_poses.txt", "trajectory.txt", "odom_poses.txt", "odometry.txt",
                             "poses.csv", "pos_log.txt"});
  std::error_code error;
  if (!named.empty() || !fs::is_directory(directory, error)) return named;
  std::vector<fs::path> found;
  for (const std::string_view ending : {".tum", "_poses_tum.txt", "_poses_kitti.txt"}) {
    const std::string_view extension = ending.substr(ending.rfind('.'));
    for (const fs::path& file : list_files(directory, extension)) {
      if (lower_case(file.filename().string()).ends_with(ending)) found.push_back(file);
    }
    if (found.size() == 1) return found.front();
    found.clear();
  }
  return {};
}

std::string remedy_for_missing_poses() {
  return "the scans need the poses of an odometry: one a scan as poses.txt (KITTI) or with stamps "
         "(TUM) beside them, or a file named with --poses. Where there is none, an odometry makes "
         "it, e.g. `kiss_icp_pipeline FOLDER` writes *_poses_tum.txt and *_poses_kitti.txt";
}

namespace {

class PcdDataset : public SequenceDataset {
 public:
  explicit PcdDataset(Sequence sequence) : SequenceDataset(std::move(sequence)) {}

  void read_scan(std::size_t i, Scan& scan) const override {
    parse_pcd(read_file(file(i)), file(i), scan);
  }
};

}  // namespace

bool recognises_pcd(const fs::path& directory) {
  return holds(find_cloud_directory(directory), ".pcd");
}

std::unique_ptr<Dataset> open_pcd(const fs::path& directory, const OpenOptions& options) {
  const fs::path clouds = find_cloud_directory(directory);
  if (clouds.empty()) fail(directory, "holds no Scans/ or pcd/ directory");
  auto files = list_files(clouds, ".pcd");
  if (files.empty()) fail(clouds, "holds no *.pcd scans");
  const fs::path poses_file = options.poses.empty() ? find_poses_file(directory) : options.poses;
  const auto [trajectory, are_recorded] = read_folder_poses(poses_file, files.size(), options);
  Sequence sequence = make_sequence({.files = std::move(files),
                                     .trajectory = trajectory,
                                     .poses_file = poses_file,
                                     .times_file = directory / "times.txt",
                                     .are_numbered_by_line = !are_recorded});
  sequence.has_poses = are_recorded;
  return std::make_unique<PcdDataset>(std::move(sequence));
}

}  // namespace unimapper::datasets
