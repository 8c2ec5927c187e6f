// Synthetic recordings of simple surroundings
#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::input {

/// A recording in memory.
class MemoryDataset : public datasets::Dataset {
 public:
  std::vector<datasets::Scan> scans;
  std::vector<Pose> poses;
  std::vector<std::int64_t> stamps_ns;

  [[nodiscard]] std::size_t scan_count() const override { return scans.size(); }
  void read_scan(std::size_t i, datasets::Scan& scan) const override { scan = scans.at(i); }
  [[nodiscard]] const Pose& pose(std::size_t i) const override { return poses.at(i); }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override { return stamps_ns.at(i); }
  [[nodiscard]] std::string scan_name(std::size_t i) const override { return std::to_string(i); }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t) const override { return {}; }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return {}; }

  /// Applies `change` to every point.
  void change_points(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& change) {
    for (datasets::Scan& scan : scans) change_points(scan, change);
  }
  static void change_points(datasets::Scan& scan,
                            const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& change) {
    for (datasets::Scan::Point& p : scan.points) {
      const Eigen::Vector3f q = change(Eigen::Vector3d(p.x, p.y, p.z)).cast<float>();
      p = {q.x(), q.y(), q.z(), p.intensity};
    }
  }
  /// Moves the points of a scan.
  static void move_points(datasets::Scan& scan, const Pose& pose) {
    change_points(scan, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(pose * p); });
  }
};

/// A rectangle: corner, two edges.
struct Sheet {
  Eigen::Vector3d corner;
  Eigen::Vector3d u;
  Eigen::Vector3d v;
};

/// Ground, four walls and three blocks in a courtyard of 60 m by 44 m.
inline std::vector<Sheet> courtyard() {
  std::vector<Sheet> sheets = {{{-30, -22, 0}, {60, 0, 0}, {0, 44, 0}}};
  const auto block = [&](double x0, double y0, double x1, double y1, double height) {
    sheets.push_back({{x0, y0, 0}, {x1 - x0, 0, 0}, {0, 0, height}});
    sheets.push_back({{x0, y1, 0}, {x1 - x0, 0, 0}, {0, 0, height}});
    sheets.push_back({{x0, y0, 0}, {0, y1 - y0, 0}, {0, 0, height}});
    sheets.push_back({{x1, y0, 0}, {0, y1 - y0, 0}, {0, 0, height}});
  };
  block(-30, -22, 30, 22, 8);
  block(-20, 6, -12, 14, 5);
  block(4, -18, 15, -13, 6);
  block(18, 8, 24, 18, 4);
  return sheets;
}

/// `scans` scans of `sheets`, each of other points, along `path` (T_world_sensor by scan). Few
/// points: more are thinned before anything is compared, which takes most of the time.
inline MemoryDataset record(const std::vector<Sheet>& sheets, std::size_t scans,
                            const std::function<Pose(std::size_t)>& path,
                            double points_per_m2 = 2.5) {
  MemoryDataset recording;
  std::mt19937 random(7);  // NOLINT: the same recording every time
  const auto uniform = [&] { return static_cast<double>(random() >> 8U) / 16777216.0; };
  for (std::size_t i = 0; i < scans; ++i) {
    const Pose T_world_sensor = path(i);
    const Pose T_sensor_world = T_world_sensor.inverse();
    datasets::Scan scan;
    for (const Sheet& sheet : sheets) {
      const auto count = static_cast<std::size_t>(points_per_m2 * sheet.u.norm() * sheet.v.norm());
      for (std::size_t k = 0; k < count; ++k) {
        const Eigen::Vector3d p =
            T_sensor_world *
            Eigen::Vector3d(sheet.corner + uniform() * sheet.u + uniform() * sheet.v);
        scan.points.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()),
                               static_cast<float>(p.z() + 0.02 * (uniform() - 0.5)), 0.5F});
      }
    }
    recording.scans.push_back(std::move(scan));
    recording.poses.push_back(T_world_sensor);
    recording.stamps_ns.push_back(static_cast<std::int64_t>(i) * 100'000'000);
  }
  return recording;
}

/// Heading and position on the level.
inline Pose level_pose(double x, double y, double yaw_rad) {
  return {Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
          Eigen::Vector3d(x, y, 1.5)};
}

/// An S through the courtyard: 0.5 m a scan, turning all the time, now left, now right.
inline Pose winding(std::size_t i) {
  double x = -24.0;
  double y = -4.0;
  double yaw = 0.2;
  for (std::size_t k = 0; k < i; ++k) {
    yaw += 0.07 * std::cos(0.25 * static_cast<double>(k));
    x += 0.5 * std::cos(yaw);
    y += 0.5 * std::sin(yaw);
  }
  return level_pose(x, y, yaw);
}

inline MemoryDataset courtyard_drive(std::size_t scans = 40) {
  return record(courtyard(), scans, winding);
}

}  // namespace unimapper::input
