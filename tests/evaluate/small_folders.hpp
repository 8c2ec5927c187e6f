// Small recordings, runs and maps in folders, for tests.
#pragma once

#include <nlohmann/json.hpp>

#include "ports/datasets/writers.hpp"
#include "tests/test.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::test {

inline std::string scan_name(std::size_t i) {
  const std::string number = std::to_string(i);
  return std::string(6 - number.size(), '0') + number;
}

inline Pose at(double x, double y = 0.0) { return {Eigen::Matrix3d::Identity(), {x, y, 0.0}}; }

inline const std::string kLoopsHeader =
    "query_session,query_keyframe,query_scan,match_session,match_keyframe,match_scan,"
    "confidence,accepted,reason,x,y,z,qx,qy,qz,qw\n";

inline void write_lines(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

/// A KITTI-form dataset with one scan per pose.
inline void write_dataset(const std::filesystem::path& directory, const std::vector<Pose>& truth,
                          const std::vector<datasets::Scan::Point>& points,
                          const std::vector<std::uint32_t>& labels = {}) {
  std::filesystem::create_directories(directory / "scans");
  std::filesystem::create_directories(directory / "labels");
  for (std::size_t i = 0; i < truth.size(); ++i) {
    datasets::write_kitti_scan(directory / "scans" / (scan_name(i) + ".bin"), points);
    if (labels.empty()) continue;
    datasets::write_labels(directory / "labels" / (scan_name(i) + ".label"), labels);
  }
  // Odometry far from the truth.
  datasets::write_kitti_poses(directory / "poses.txt", std::vector<Pose>(truth.size(), at(0)));
  datasets::write_kitti_poses(directory / "gt_poses.txt", truth);
}

inline void write_run_labels(const std::filesystem::path& run, std::size_t scans,
                             const std::vector<std::uint32_t>& labels) {
  std::filesystem::create_directories(run / "labels");
  for (std::size_t i = 0; i < scans; ++i) {
    datasets::write_labels(run / "labels" / (scan_name(i) + ".label"), labels);
  }
}

inline std::vector<Pose> circle() {
  std::vector<Pose> truth;
  for (int i = 0; i < 30; ++i) truth.push_back(at(10 * std::cos(0.2 * i), 10 * std::sin(0.2 * i)));
  return truth;
}

/// A map of sessions that went the same way, ten poses a second, those besides the central one too
/// high.
inline void write_map(const std::filesystem::path& map,
                      const std::vector<std::pair<std::string, std::string>>& sessions,
                      const std::vector<Pose>& truth, const Pose& T_map_truth = {},
                      double too_high_m = 0.0) {
  std::filesystem::create_directories(map / "trajectories");
  nlohmann::json summary;
  for (const auto& [name, status] : sessions) {
    summary["sessions"].push_back(
        {{"name", name}, {"status", status}, {"keyframes", truth.size()}});
    std::vector<std::int64_t> stamps;
    std::vector<Pose> poses;
    for (const Pose& pose : truth) {
      stamps.push_back(static_cast<std::int64_t>(stamps.size()) * 100'000'000);
      poses.push_back(T_map_truth * pose);
      if (status != "central") poses.back().translation.z() += too_high_m;
    }
    datasets::write_tum(map / "trajectories" / (name + ".tum"), stamps, poses);
  }
  write_lines(map / "summary.json", summary.dump());
}

}  // namespace unimapper::test
