// Scans of a room of boxes, for tests of the odometry.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "tests/random.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/odometry/odometry.hpp"

namespace unimapper::test {

/// A box parallel to the axes, metres.
struct SceneBox {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

/// A closed room, seen from within, and what stands in it.
struct BoxScene {
  SceneBox room;
  std::vector<SceneBox> things;

  /// Distance to the first surface from a point in the room.
  [[nodiscard]] double range(const Eigen::Vector3d& from, const Eigen::Vector3d& along) const {
    double nearest = crossing(room, from, along).second;
    for (const SceneBox& thing : things) {
      const auto [in, out] = crossing(thing, from, along);
      if (in > 0.0 && in < out) nearest = std::min(nearest, in);
    }
    return nearest;
  }

 private:
  static std::pair<double, double> crossing(const SceneBox& box, const Eigen::Vector3d& from,
                                            const Eigen::Vector3d& along) {
    const Eigen::Array3d a = (box.low - from).array() / along.array();
    const Eigen::Array3d b = (box.high - from).array() / along.array();
    return {a.min(b).maxCoeff(), a.max(b).minCoeff()};
  }
};

/// A hall with pillars and crates.
inline BoxScene hall() {
  BoxScene scene{{{-30.0, -12.0, -1.5}, {30.0, 12.0, 6.0}}, {}};
  for (int i = 0; i < 7; ++i) {
    const double x = -24.0 + 8.0 * i;
    scene.things.push_back({{x, -7.0, -1.5}, {x + 1.0, -6.0, 6.0}});
    scene.things.push_back({{x + 3.0, 6.0, -1.5}, {x + 4.5, 8.0, 0.2 + 0.3 * i}});
  }
  return scene;
}

/// A bare corridor along x.
inline BoxScene corridor() { return {{{-400.0, -2.5, -1.5}, {400.0, 3.0, 2.0}}, {}}; }

/// A place that looks like neither.
inline BoxScene elsewhere() {
  return {{{-9.0, -30.0, -3.0}, {14.0, 22.0, 9.0}}, {{{3.0, -8.0, -3.0}, {7.0, -2.0, 1.0}}}};
}

/// One sweep.
struct SweptScan {
  std::vector<Eigen::Vector3f> points;
  std::vector<float> time_s;
  [[nodiscard]] PointView view() const {
    return PointView::xyz(points.data(), points.size(), sizeof(Eigen::Vector3f));
  }
};

/// T_scene_sensor at a time after the stamp, seconds.
using SensorMotion = std::function<Pose(double)>;

/// A sweep of 24 rings in the tenth of a second before the stamp, with a centimetre of noise.
inline SweptScan sweep(const BoxScene& scene, const SensorMotion& motion, std::uint64_t seed = 1,
                       int columns = 240) {
  constexpr int kRings = 24;
  Random random(seed);
  SweptScan scan;
  for (int column = 0; column < columns; ++column) {
    const double time_s = -0.1 + 0.1 * column / columns;
    const Pose T_scene_sensor = motion(time_s);
    // Not along an axis: the slopes of the boxes' sides must be finite.
    const double azimuth = 2.0 * 3.14159265 * (column + 0.31) / columns;
    for (int ring = 0; ring < kRings; ++ring) {
      const double elevation = -0.35 + 0.6 * (ring + 0.37) / kRings;
      const Eigen::Vector3d ray(std::cos(azimuth) * std::cos(elevation),
                                std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
      const double range_m =
          scene.range(T_scene_sensor.translation, T_scene_sensor.rotation * ray) +
          random.uniform(-0.01, 0.01);
      scan.points.emplace_back((range_m * ray).cast<float>());
      scan.time_s.push_back(static_cast<float>(time_s));
    }
  }
  return scan;
}

/// A scan taken at once.
inline SweptScan snapshot(const BoxScene& scene, const Pose& T_scene_sensor,
                          std::uint64_t seed = 1) {
  SweptScan scan = sweep(
      scene, [&](double) { return T_scene_sensor; }, seed);
  scan.time_s.clear();
  return scan;
}

inline constexpr std::int64_t kPeriod_ns = 100'000'000;

/// A sensor on the level.
inline Pose level(double x_m, double y_m, double yaw_rad) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())),
          {x_m, y_m, 0.0}};
}

/// Small, so that tests are quick.
inline LidarOdometryConfig test_config() {
  LidarOdometryConfig config;
  config.max_voxels = 1U << 14U;
  config.max_points = 1U << 14U;
  return config;
}

/// An odometry in memory of its own.
class TestOdometry {
 public:
  explicit TestOdometry(const LidarOdometryConfig& config = test_config())
      : memory_(LidarOdometry::required_bytes(config)),
        odometry_(*LidarOdometry::create(config, memory_.span())) {}
  LidarOdometry* operator->() { return odometry_; }

  /// Adds a scan 0.1 s after the last one.
  OdometryResult add(const SweptScan& scan) {
    return odometry_->add_scan(stamp_ns_ += kPeriod_ns, scan.view(), scan.time_s);
  }

  /// The same, where the result does not matter.
  void pass(const SweptScan& scan) { static_cast<void>(add(scan)); }

 private:
  MemoryBlock memory_;
  LidarOdometry* odometry_;
  std::int64_t stamp_ns_ = 0;
};

/// What separates an estimate from the truth since the first scan.
struct PoseError {
  double translation_m;
  double rotation_deg;
};
inline PoseError error_of(const OdometryResult& result, const Pose& T_scene_first,
                          const Pose& T_scene_sensor) {
  const Pose truth = T_scene_first.inverse() * T_scene_sensor;
  const Pose off = truth.inverse() * result.T_odometry_sensor;
  return {off.translation.norm(), rotation_angle(off.rotation) * kDegreesPerRadian};
}

}  // namespace unimapper::test
