// Reader of KITTI, SemanticKITTI and simulated recordings.
#include <cstring>
#include <optional>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/pcd_sequence.hpp"
#include "ports/datasets/record_width.hpp"
#include "ports/datasets/sequence.hpp"
#include "ports/datasets/text_encoding.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

/// T_camera_lidar of KITTI odometry; empty where there is no such file or line.
std::optional<Pose> read_calibration(const fs::path& directory) {
  const fs::path file = directory / "calib.txt";
  if (!fs::exists(file)) return std::nullopt;
  return parse_calibration(read_text(file), file);
}

/// Poses are stored in the left camera's frame: T_lidar0_lidar = Tr^-1 P Tr.
void apply_calibration(const fs::path& directory, std::vector<Pose>& poses) {
  const auto T_camera_lidar = read_calibration(directory);
  if (!T_camera_lidar) return;
  for (Pose& pose : poses) pose = T_camera_lidar->inverse() * pose * *T_camera_lidar;
}

/// The poses the user names, those beside the scans, or where KITTI odometry keeps them:
/// poses/NN.txt for sequences/NN.
fs::path find_kitti_poses(const fs::path& directory, const OpenOptions& options) {
  if (!options.poses.empty()) return options.poses;
  if (fs::exists(directory / "poses.txt")) return directory / "poses.txt";
  const fs::path sequence = fs::absolute(directory / "").parent_path();
  fs::path shared =
      sequence.parent_path().parent_path() / "poses" / (sequence.filename().string() + ".txt");
  if (fs::exists(shared)) return shared;
  const fs::path other = find_poses_file(directory);
  return other.empty() ? directory / "poses.txt" : other;
}

class KittiDataset : public SequenceDataset {
 public:
  KittiDataset(fs::path directory, Sequence sequence, RecordLayout layout)
      : SequenceDataset(std::move(sequence)),
        directory_(std::move(directory)),
        layout_(std::move(layout)) {}

  void read_scan(std::size_t i, Scan& scan) const override { read_records(file(i), layout_, scan); }

  [[nodiscard]] std::string scan_name(std::size_t i) const override { return stem_of(file(i)); }

  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t i) const override {
    const fs::path label_file = directory_ / "labels" / (scan_name(i) + ".label");
    if (!fs::exists(label_file)) return {};
    const std::string bytes = read_file(label_file);
    const std::uint64_t points = file_bytes(file(i)) / layout_.bytes;
    if (bytes.size() != points * sizeof(std::uint32_t)) {
      fail_at_offset(label_file, bytes.size(),
                     "ends after " + std::to_string(bytes.size()) + " bytes, but the scan has " +
                         std::to_string(points) + " points of 4 label bytes each");
    }
    std::vector<std::uint32_t> values(static_cast<std::size_t>(points));
    if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override {
    const fs::path truth_file = directory_ / "gt_poses.txt";
    if (!fs::exists(truth_file)) return {};
    const Trajectory truth = parse_trajectory(read_text(truth_file), truth_file);
    std::vector<Pose> poses;
    const auto lines = match_lines(sequence().files, truth.poses.size(), truth_file, "poses",
                                   read_calibration(directory_).has_value());
    poses.reserve(lines.size());
    for (const std::size_t line : lines) poses.push_back(truth.poses[line]);
    apply_calibration(directory_, poses);
    return poses;
  }

  /// KITTI's own folder name stands for KITTI's own LiDAR; `scans/` may come from any.
  [[nodiscard]] std::string sensor() const override {
    const bool is_kitti = lower_case(file(0).parent_path().filename().string()) == "velodyne";
    return is_kitti ? std::string(sensor_model(SensorKind::kHdl64e).name) : std::string();
  }

 private:
  fs::path directory_;
  RecordLayout layout_;
};

/// The folder `sequences/` of KITTI odometry's root; empty if there is none.
fs::path find_sequences(const fs::path& directory) {
  const fs::path below = find_child(directory, {"dataset"});
  const fs::path direct = find_child(directory, {"sequences"});
  return direct.empty() && !below.empty() ? find_child(below, {"sequences"}) : direct;
}

/// `directory` itself, or the sequence below it that the user names or that is alone.
fs::path choose_sequence(const fs::path& directory, const std::string& wanted) {
  const fs::path sequences = find_sequences(directory);
  if (sequences.empty()) return directory;
  std::vector<fs::path> found;
  std::string names;
  for (const fs::path& child : list_directories(sequences)) {
    if (find_child(child, {"velodyne", "scans"}).empty()) continue;
    const std::string name = child.filename().string();
    names += (names.empty() ? "" : ", ") + name;
    if (wanted.empty() || name == wanted) found.push_back(child);
  }
  if (found.size() == 1) return found.front();
  fail(sequences, names.empty() ? "holds no sequence with velodyne/"
                                : "choose one with --sequence: there are " + names);
}

}  // namespace

bool recognises_kitti(const fs::path& directory) {
  return holds(find_child(directory, {"scans", "velodyne"}), ".bin") ||
         !find_sequences(directory).empty();
}

std::unique_ptr<Dataset> open_kitti(const fs::path& path, const OpenOptions& options) {
  const fs::path directory = choose_sequence(path, options.sequence);
  const fs::path scans = find_child(directory, {"scans", "velodyne"});
  if (scans.empty()) fail(directory, "holds no scans/ or velodyne/ directory");
  auto files = list_files(scans, ".bin");
  if (files.empty()) fail(scans, "holds no *.bin scans");
  // Damage is reported here rather than in the middle of a long run.
  std::vector<Note> notes;
  RecordLayout layout = find_record_layout(files, options.point_fields, notes);

  const fs::path poses_file = find_kitti_poses(directory, options);
  const auto [trajectory, are_recorded] = read_folder_poses(poses_file, files.size(), options);
  const bool is_of_kitti =
      read_calibration(directory).has_value() || poses_file.parent_path().filename() == "poses";
  Sequence sequence = make_sequence({.files = std::move(files),
                                     .trajectory = trajectory,
                                     .poses_file = poses_file,
                                     .times_file = directory / "times.txt",
                                     .are_numbered_by_line = is_of_kitti || !are_recorded});
  sequence.has_poses = are_recorded;
  if (trajectory.stamps_ns.empty()) {
    apply_calibration(directory, sequence.poses);
  } else if (read_calibration(directory)) {
    sequence.notes.push_back({"poses with stamps: taken for the LiDAR's, not the camera's"});
  }
  sequence.notes.insert(sequence.notes.begin(), notes.begin(), notes.end());
  return std::make_unique<KittiDataset>(directory, std::move(sequence), std::move(layout));
}

}  // namespace unimapper::datasets
