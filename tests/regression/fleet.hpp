// Robots with tilted sensors and leaning, turned odometry frames in a simulated street
#pragma once

#include "tests/merge/random.hpp"
#include "tests/onboard/scene.hpp"
#include "tests/test.hpp"
#include "unimapper/core/ids.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::regression {

using merge::testing::Random;

/// Roll, pitch and yaw, applied in the order yaw, pitch, roll from the outside; degrees.
inline Pose turned(double roll_deg, double pitch_deg, double yaw_deg,
                   const Eigen::Vector3d& translation) {
  const auto about = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees / kDegreesPerRadian, axis);
  };
  const Eigen::Matrix3d rotation =
      (about(yaw_deg, Eigen::Vector3d::UnitZ()) * about(pitch_deg, Eigen::Vector3d::UnitY()) *
       about(roll_deg, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return {rotation, translation};
}

/// Houses and posts on both sides of a street along x from -20 to 80 m, and a cross street. Some
/// boxes walk or drive.
inline test::Scene make_street(std::uint64_t seed) {
  Random random(seed);
  test::Scene street;
  street.rings = 24;
  street.columns = 400;
  street.max_range = 45.0;
  for (const double side : {-1.0, 1.0}) {
    for (double x = -20.0; x < 80.0;) {
      const double length = random.uniform(5.0, 11.0);
      const double setback = random.uniform(6.0, 10.0);
      const double depth = random.uniform(3.0, 6.0);
      const double height = random.uniform(3.0, 9.0);
      street.boxes.push_back(
          test::standing_box({x + 0.5 * length, side * (setback + 0.5 * depth), 0.5 * height},
                             {0.5 * length, 0.5 * depth, 0.5 * height}));
      x += length + random.uniform(1.0, 6.0);
    }
    for (int post = 0; post < 7; ++post) {
      const double x = random.uniform(-15.0, 75.0);
      const double height = random.uniform(2.0, 5.0);
      street.boxes.push_back(test::standing_box({x, side * random.uniform(4.5, 5.5), 0.5 * height},
                                                {0.12, 0.12, 0.5 * height}));
    }
  }
  for (int walker = 0; walker < 4; ++walker) {
    const double x = 8.0 + 14.0 * walker;
    const double side = walker % 2 == 0 ? 1.0 : -1.0;
    street.boxes.push_back(
        test::moving_box({x, side * 3.6, 0.9}, {side * 0.9, -side * 0.25, 0.0}, {0.3, 0.3, 0.9}));
  }
  return street;
}

/// A drive: where it went, how the sensor is mounted, and what odometry makes of it.
struct Robot {
  SessionInfo info;
  std::vector<Eigen::Vector2d> corners;  ///< of the way, metres
  Pose T_vehicle_sensor;                 ///< mounting
  Pose T_odometry_scene;                 ///< at the start of the drive
  double start_s = 0.0;                  ///< time of day
  double step_m = 1.2;                   ///< between two scans
  double drift_m = 0.006;                ///< per scan and axis, standard deviation
  double drift_rad = 0.0003;
  std::size_t half_the_columns_from = 10000;  ///< scan
};

/// Poses of the sensor, scan by scan: the true ones in the scene, and odometry's.
struct SensorPath {
  std::vector<Pose> T_scene_sensor;
  std::vector<Pose> T_odometry_sensor;
};

inline SensorPath drive(const Robot& robot) {
  Random random(robot.info.id.boot.low);
  SensorPath path;
  for (std::size_t leg = 0; leg + 1 < robot.corners.size(); ++leg) {
    const Eigen::Vector2d way = robot.corners[leg + 1] - robot.corners[leg];
    const double yaw = std::atan2(way.y(), way.x());
    const int steps = static_cast<int>(way.norm() / robot.step_m);
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector2d at = robot.corners[leg] + way.normalized() * robot.step_m * i;
      // The vehicle sways and nods a little.
      const double sway = 0.8 * std::sin(0.7 * i);
      const double nod = 0.6 * std::sin(0.4 * i + 1.0);
      const Pose T_scene_vehicle =
          turned(sway, nod, yaw * kDegreesPerRadian, {at.x(), at.y(), 0.0});
      path.T_scene_sensor.push_back(T_scene_vehicle * robot.T_vehicle_sensor);
    }
  }
  path.T_odometry_sensor.push_back(robot.T_odometry_scene * path.T_scene_sensor[0]);
  for (std::size_t i = 1; i < path.T_scene_sensor.size(); ++i) {
    const Pose step = path.T_scene_sensor[i - 1].inverse() * path.T_scene_sensor[i];
    const Pose drift = random.pose(robot.drift_m, robot.drift_rad);
    path.T_odometry_sensor.push_back(path.T_odometry_sensor.back() * step * drift);
  }
  return path;
}

}  // namespace unimapper::regression
