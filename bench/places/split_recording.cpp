// Command-line tool: two sessions out of one recording, by alternate scans or cut in two.
//
// The second session gets another odometry frame, as if the robot had started elsewhere; the true
// poses are written beside both as gt_poses.txt. Scans are symbolic links.
#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/writers.hpp"

namespace {

using namespace unimapper;
namespace fs = std::filesystem;

/// Yaw far from any symmetry, a tilt, an origin where floats lose precision.
Pose other_odometry(double tilt_deg) {
  const Eigen::AngleAxisd yaw(137.0 / kDegreesPerRadian, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd roll(tilt_deg / kDegreesPerRadian, Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(yaw * roll), {5000.0, -3000.0, 40.0}};
}

struct Session {
  std::vector<std::size_t> scans;
  Pose T_session_odometry;
};

void write_session(const fs::path& recording, const datasets::Dataset& dataset,
                   const Session& session, const fs::path& out) {
  datasets::make_directory(out / "velodyne");
  std::vector<Pose> poses;
  std::vector<Pose> truth;
  std::vector<std::int64_t> stamps_ns;
  for (const std::size_t scan : session.scans) {
    char name[16];
    std::snprintf(name, sizeof name, "%06zu.bin", poses.size());
    fs::create_symlink(fs::absolute(recording / "velodyne" / (dataset.scan_name(scan) + ".bin")),
                       out / "velodyne" / name);
    truth.push_back(dataset.pose(scan));
    poses.push_back(session.T_session_odometry * dataset.pose(scan));
    stamps_ns.push_back(dataset.stamp_ns(scan));
  }
  datasets::write_kitti_poses(out / "poses.txt", poses);
  datasets::write_kitti_poses(out / "gt_poses.txt", truth);
  datasets::write_times(out / "times.txt", stamps_ns);
}

/// Scans of the first session where the recording is cut in two.
std::size_t cut_at(std::string_view how, std::size_t scans) {
  if (how == "first-third") return scans / 3;
  return how == "last-third" ? 2 * scans / 3 : scans / 2;
}

void split(std::string_view how, double tilt_deg, const fs::path& recording, const fs::path& out) {
  const auto dataset = datasets::open_dataset(recording);
  Session first;
  Session second{{}, other_odometry(tilt_deg)};
  const std::size_t cut = cut_at(how, dataset->scan_count());
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    const bool in_first = how == "alternating" ? i % 2 == 0 : i < cut;
    (in_first ? first : second).scans.push_back(i);
  }
  write_session(recording, *dataset, first, out / "A");
  write_session(recording, *dataset, second, out / "B");
}

}  // namespace

int main(int argc, char** argv) {
  std::string how;
  double tilt_deg = 2.0;
  fs::path recording;
  fs::path out;
  CLI::App app{"Makes two sessions of one recording, OUT/A and OUT/B."};
  app.add_option("HOW", how, "Every second scan, or cut after a half, a third, two thirds")
      ->required()
      ->check(CLI::IsMember({"alternating", "halves", "first-third", "last-third"}));
  app.add_option("RECORDING", recording)->required()->check(CLI::ExistingDirectory);
  app.add_option("OUT", out)->required();
  app.add_option("--tilt-deg", tilt_deg, "Roll of the second session's odometry")
      ->capture_default_str()
      ->check(CLI::Range(-45.0, 45.0));
  CLI11_PARSE(app, argc, argv);
  try {
    split(how, tilt_deg, recording, out);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "split_recording: %s\n", error.what());
    return 1;
  }
}
