// Reader of KITTI raw drives.
#include "ports/datasets/kitti_raw.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/record_width.hpp"
#include "ports/datasets/sequence.hpp"
#include "ports/datasets/text.hpp"
#include "ports/datasets/text_encoding.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

Oxts parse_oxts(std::string_view text, const fs::path& file) {
  constexpr std::size_t kNeeded = 6;
  std::array<double, kNeeded> values{};
  bool has_line = false;
  for_each_row(text, [&](const Columns& columns, std::size_t line) {
    if (has_line) return;
    has_line = true;
    if (columns.count < kNeeded) {
      fail_at_line(file, line, "expected latitude, longitude, altitude, roll, pitch, yaw, ...");
    }
    for (std::size_t i = 0; i < kNeeded; ++i) {
      values[i] = parse_number(columns.text[i], file, line);
    }
    constexpr double kMostLatitude = 89.0;  // Mercator ends before the poles
    if (std::abs(values[0]) > kMostLatitude || std::abs(values[1]) > 360.0) {
      fail_at_line(file, line, "no latitude and longitude in degrees");
    }
  });
  if (!has_line) fail(file, "is empty");
  return {values[0], values[1], values[2], values[3], values[4], values[5]};
}

Pose mercator_pose(const Oxts& oxts, double scale) {
  constexpr double kEarthRadius_m = 6378137.0;
  constexpr double kRadians = std::numbers::pi / 180.0;
  const Eigen::Quaterniond q = Eigen::AngleAxisd(oxts.yaw_rad, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(oxts.pitch_rad, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(oxts.roll_rad, Eigen::Vector3d::UnitX());
  const double north = std::log(std::tan((90.0 + oxts.latitude_deg) * kRadians / 2.0));
  return {q, Eigen::Vector3d(scale * kEarthRadius_m * oxts.longitude_deg * kRadians,
                             scale * kEarthRadius_m * north, oxts.altitude_m)};
}

std::optional<Pose> parse_raw_calibration(std::string_view text, const fs::path& file) {
  std::optional<Eigen::Matrix3d> rotation;
  std::optional<Eigen::Vector3d> translation;
  for_each_row(text, [&](const Columns& columns, std::size_t line) {
    const auto number = [&](std::size_t i) { return parse_number(columns.text[i], file, line); };
    if (columns.text[0] == "R:" && columns.count == 10) {
      Eigen::Matrix3d r;
      for (std::size_t i = 0; i < 9; ++i) {
        r(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) = number(i + 1);
      }
      rotation = r;
    }
    if (columns.text[0] == "T:" && columns.count == 4) {
      translation = Eigen::Vector3d(number(1), number(2), number(3));
    }
  });
  if (!rotation || !translation) return std::nullopt;
  Pose pose(*rotation, *translation);
  if (!pose.is_rigid()) return std::nullopt;
  pose.rotation = Eigen::Quaterniond(pose.rotation).normalized().toRotationMatrix();
  return pose;
}

namespace {

/// The drive: `directory` itself, or the one below that the user names or that is alone.
fs::path choose_drive(const fs::path& directory, const std::string& wanted) {
  if (!find_child(directory, {"velodyne_points"}).empty()) return directory;
  std::vector<fs::path> drives;
  std::string names;
  for (const fs::path& child : list_directories(directory)) {
    if (find_child(child, {"velodyne_points"}).empty()) continue;
    const std::string name = child.filename().string();
    names += (names.empty() ? "" : ", ") + name;
    if (wanted.empty() || name == wanted || name.find("drive_" + wanted) != std::string::npos) {
      drives.push_back(child);
    }
  }
  if (drives.size() == 1) return drives.front();
  if (names.empty()) fail(directory, "holds no velodyne_points/ and no drive with one");
  fail(directory, "choose a drive with --sequence: there are " + names);
}

Trajectory read_oxts(const fs::path& drive) {
  const fs::path oxts = find_child(drive, {"oxts"});
  if (oxts.empty()) {
    fail(drive, "holds no oxts/ with the poses of GPS and IMU; KITTI offers it beside the scans");
  }
  Trajectory trajectory;
  std::optional<double> scale;
  for (const fs::path& file : list_files(oxts / "data", ".txt")) {
    const Oxts packet = parse_oxts(read_file(file), file);
    if (!scale) scale = std::cos(packet.latitude_deg * std::numbers::pi / 180.0);
    trajectory.poses.push_back(mercator_pose(packet, *scale));
  }
  const fs::path times = oxts / "timestamps.txt";
  trajectory.stamps_ns = parse_times(read_text(times), times);
  if (trajectory.stamps_ns.size() != trajectory.poses.size()) {
    fail(times, std::to_string(trajectory.stamps_ns.size()) + " stamps for " +
                    std::to_string(trajectory.poses.size()) + " packets in data/");
  }
  return trajectory;
}

/// From the IMU's poses to the LiDAR's, with the first position as origin.
void to_lidar(const fs::path& drive, Trajectory& trajectory, std::vector<Note>& notes) {
  Pose T_imu_velodyne;
  const fs::path beside = fs::absolute(drive / "").parent_path().parent_path();
  fs::path file = beside / "calib_imu_to_velo.txt";
  if (!fs::exists(file)) file = drive / "calib_imu_to_velo.txt";
  std::optional<Pose> T_velodyne_imu;
  if (fs::exists(file)) T_velodyne_imu = parse_raw_calibration(read_text(file), file);
  if (T_velodyne_imu) {
    T_imu_velodyne = T_velodyne_imu->inverse();
  } else {
    // Mounting of KITTI's car.
    T_imu_velodyne.translation = {0.81, -0.32, 0.80};
    notes.push_back(
        {"no calib_imu_to_velo.txt: the LiDAR is taken to be where KITTI's car has it"});
  }
  const Eigen::Vector3d origin = trajectory.poses.front().translation;
  for (Pose& pose : trajectory.poses) {
    pose.translation -= origin;
    pose = pose * T_imu_velodyne;
  }
}

class KittiRawDataset : public SequenceDataset {
 public:
  KittiRawDataset(Sequence sequence, RecordLayout layout)
      : SequenceDataset(std::move(sequence)), layout_(std::move(layout)) {}

  void read_scan(std::size_t i, Scan& scan) const override { read_records(file(i), layout_, scan); }
  [[nodiscard]] std::string sensor() const override {
    return std::string(sensor_model(SensorKind::kHdl64e).name);
  }

 private:
  RecordLayout layout_;
};

}  // namespace

bool recognises_kitti_raw(const fs::path& directory) {
  std::error_code error;
  if (!fs::is_directory(directory, error)) return false;
  if (!find_child(directory, {"velodyne_points"}).empty()) return true;
  for (const fs::path& child : list_directories(directory)) {
    if (!find_child(child, {"velodyne_points"}).empty()) return true;
  }
  return false;
}

std::unique_ptr<Dataset> open_kitti_raw(const fs::path& directory, const OpenOptions& options) {
  const fs::path drive = choose_drive(directory, options.sequence);
  const fs::path scans = find_child(drive, {"velodyne_points"});
  auto files = list_files(scans / "data", ".bin");
  if (files.empty()) {
    fail(scans / "data",
         "holds no *.bin scans; KITTI's text scans are converted to them by its "
         "development kit");
  }
  std::vector<Note> notes;
  RecordLayout layout = find_record_layout(files, options.point_fields, notes);
  Trajectory trajectory;
  fs::path poses_file = options.poses;
  if (poses_file.empty()) {
    poses_file = drive / "oxts";
    trajectory = read_oxts(drive);
    if (trajectory.poses.empty()) fail(poses_file, "holds no packets");
    to_lidar(drive, trajectory, notes);
  } else {
    trajectory = parse_trajectory(read_text(poses_file), poses_file);
  }
  Sequence sequence = make_sequence({.files = std::move(files),
                                     .trajectory = trajectory,
                                     .poses_file = poses_file,
                                     .times_file = scans / "timestamps.txt",
                                     .are_numbered_by_line = true});
  sequence.notes.insert(sequence.notes.begin(), notes.begin(), notes.end());
  return std::make_unique<KittiRawDataset>(std::move(sequence), std::move(layout));
}

}  // namespace unimapper::datasets
