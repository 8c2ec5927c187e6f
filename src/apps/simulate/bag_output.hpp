// Recordings of a simulated robot's messages as bags.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "ports/bag_writers/bag_writer.hpp"
#include "src/simulator/drive.hpp"
#include "src/simulator/random.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::apps {

/// Topics of a robot with frames map, odom, base_link and lidar:
/// - /points: PointCloud2 in `lidar`, stamped with the end of the sweep, every point with its time
///   and in the frame of its time;
/// - /odom: Odometry of base_link in odom, 100 Hz;
/// - /tf: odom to base_link, 100 Hz, and map to odom, 10 Hz, which makes the truth of both;
/// - /tf_static: base_link to lidar;
/// - /imu, where asked for: angular velocity and acceleration of base_link, 100 Hz, with
///   biases, noise and vibration.
struct BagTopics {
  bool has_odometry = true;  ///< /odom and /tf, too
  bool has_imu = false;
};

/// Writes them.
class BagOutput {
 public:
  /// Writes OUT/drive.mcap, OUT/drive.bag or OUT/drive/ for each of `containers`. Throws BagError.
  BagOutput(const std::vector<bags::Container>& containers, const std::filesystem::path& out,
            const Pose& T_base_lidar, const BagTopics& topics);

  /// Throws BagError.
  void write(const simulator::DriveStep& step);
  /// Ends the recordings. Throws BagError.
  void close();

 private:
  struct Bag {
    std::unique_ptr<bags::BagWriter> writer;
    std::size_t points, odometry, transforms, static_transforms, imu;
  };

  void write_odometry(const simulator::OdometrySample& sample, bool with_truth);

  /// What an accelerometer measures at the middle of the time since the last sample.
  Eigen::Vector3d specific_force(const Pose& T_map_base, std::int64_t stamp_ns);
  void write_imu(const Pose& T_map_base, std::int64_t stamp_ns);

  std::vector<Bag> bags_;
  Pose T_base_lidar_;
  BagTopics topics_;
  simulator::Random noise_{1};
  simulator::Random shaking_{2};
  Eigen::Vector3d last_velocity_m_s_ = Eigen::Vector3d::Zero();
  std::int64_t last_velocity_ns_ = 0;
  std::vector<bags::CloudPoint> points_;
  std::int64_t last_stamp_ns_ = 0;
  Pose last_pose_;
  Pose last_true_pose_;
};

}  // namespace unimapper::apps
