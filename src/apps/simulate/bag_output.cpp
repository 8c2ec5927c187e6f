#include "src/apps/simulate/bag_output.hpp"

#include <cmath>

namespace unimapper::apps {
namespace {

Eigen::Vector3d vector(const simulator::Vec3& v) { return {v.x, v.y, v.z}; }

Pose pose(const simulator::Frame& frame) {
  Pose result;
  result.rotation << vector(frame.x), vector(frame.y), vector(frame.z);
  result.translation = vector(frame.origin);
  return result;
}

std::filesystem::path path_of(bags::Container container, const std::filesystem::path& out) {
  switch (container) {
    case bags::Container::kRosbag1:
      return out / "drive.bag";
    case bags::Container::kRosbag2:
      return out / "drive";
    case bags::Container::kMcap:
      break;
  }
  return out / "drive.mcap";
}

}  // namespace

BagOutput::BagOutput(const std::vector<bags::Container>& containers,
                     const std::filesystem::path& out, const Pose& T_base_lidar,
                     const BagTopics& topics)
    : T_base_lidar_(T_base_lidar), topics_(topics) {
  using bags::MessageType;
  for (const bags::Container container : containers) {
    Bag bag{bags::create_bag(container, path_of(container, out)), 0, 0, 0, 0, 0};
    bag.points = bag.writer->add_topic({"/points", MessageType::kPointCloud2});
    if (topics.has_odometry) {
      bag.odometry = bag.writer->add_topic({"/odom", MessageType::kOdometry});
      bag.transforms = bag.writer->add_topic({"/tf", MessageType::kTransforms});
    }
    bag.static_transforms =
        bag.writer->add_topic({"/tf_static", MessageType::kTransforms, /*is_latched=*/true});
    if (topics.has_imu) bag.imu = bag.writer->add_topic({"/imu", MessageType::kImu});
    bags_.push_back(std::move(bag));
  }
}

void BagOutput::write(const simulator::DriveStep& step) {
  if (step.scan == 0) {
    const std::int64_t stamp_ns = step.odometry.front().stamp_ns;
    const bags::Transforms mounted = {{{stamp_ns, "base_link"}, "lidar", T_base_lidar_}};
    for (Bag& bag : bags_) bag.writer->write(bag.static_transforms, stamp_ns, mounted);
  }
  for (const simulator::OdometrySample& sample : step.odometry) {
    write_odometry(sample, &sample == &step.odometry.back());
  }
  points_.clear();
  for (const simulator::RawPoint& p : step.points) {
    points_.push_back({p.x, p.y, p.z, p.intensity, p.ring, p.time_s});
  }
  const bags::PointCloud2 cloud{{step.stamp_ns, "lidar"}, points_};
  for (Bag& bag : bags_) bag.writer->write(bag.points, step.stamp_ns, cloud);
}

void BagOutput::write_odometry(const simulator::OdometrySample& sample, bool with_truth) {
  const Pose T_lidar_base = T_base_lidar_.inverse();
  const Pose T_odom_base = pose(sample.T_odometry_points) * T_lidar_base;
  const Pose T_map_base = pose(sample.T_world_points) * T_lidar_base;
  const std::int64_t stamp_ns = sample.stamp_ns;
  bags::Odometry odometry{{stamp_ns, "odom"}, "base_link", T_odom_base};
  if (last_stamp_ns_ != 0) {
    const double seconds = 1e-9 * static_cast<double>(stamp_ns - last_stamp_ns_);
    const Pose moved = last_pose_.inverse() * T_odom_base;
    const Eigen::AngleAxisd turned(moved.rotation);
    odometry.velocity = moved.translation / seconds;
    odometry.turn_rate = turned.angle() / seconds * turned.axis();
  }
  if (topics_.has_imu && last_stamp_ns_ != 0) write_imu(T_map_base, stamp_ns);
  last_stamp_ns_ = stamp_ns;
  last_pose_ = T_odom_base;
  last_true_pose_ = T_map_base;
  if (!topics_.has_odometry) return;
  bags::Transforms transforms = {{{stamp_ns, "odom"}, "base_link", T_odom_base}};
  if (with_truth) {
    transforms.push_back({{stamp_ns, "map"}, "odom", T_map_base * T_odom_base.inverse()});
  }
  for (Bag& bag : bags_) {
    bag.writer->write(bag.odometry, stamp_ns, odometry);
    bag.writer->write(bag.transforms, stamp_ns, transforms);
  }
}

Eigen::Vector3d BagOutput::specific_force(const Pose& T_map_base, std::int64_t stamp_ns) {
  constexpr double kGravity_m_s2 = 9.80665;
  constexpr double kNoise_m_s2 = 0.05;
  constexpr double kVibration_m_s2 = 1.0;  // amplitude, at 37 Hz
  constexpr double kTurns_per_s = 37.0 * 2.0 * 3.14159265358979;
  const Eigen::Vector3d bias_m_s2(0.06, -0.05, 0.04);
  const Eigen::Vector3d moved_m = T_map_base.translation - last_true_pose_.translation;
  const Eigen::Vector3d velocity_m_s =
      moved_m / (1e-9 * static_cast<double>(stamp_ns - last_stamp_ns_));
  const std::int64_t middle_ns = stamp_ns - (stamp_ns - last_stamp_ns_) / 2;
  Eigen::Vector3d force(0.0, 0.0, kGravity_m_s2);
  if (last_velocity_ns_ != 0) {
    force += (velocity_m_s - last_velocity_m_s_) /
             (1e-9 * static_cast<double>(middle_ns - last_velocity_ns_));
  }
  last_velocity_m_s_ = velocity_m_s;
  last_velocity_ns_ = middle_ns;
  force = Eigen::Vector3d(last_true_pose_.rotation.transpose() * force) + bias_m_s2;
  for (double& value : force) value += kNoise_m_s2 * shaking_.gauss();
  force.z() += kVibration_m_s2 * std::sin(kTurns_per_s * 1e-9 * static_cast<double>(middle_ns));
  return force;
}

/// The mean since the last sample of the odometry, stamped with the middle of that time.
void BagOutput::write_imu(const Pose& T_map_base, std::int64_t stamp_ns) {
  constexpr double kNoise_rad_s = 0.005;
  const Eigen::Vector3d bias_rad_s(0.01, -0.02, 0.015);
  const Eigen::AngleAxisd turned(last_true_pose_.rotation.transpose() * T_map_base.rotation);
  const std::int64_t since_ns = stamp_ns - last_stamp_ns_;
  bags::Imu imu{{stamp_ns - since_ns / 2, "base_link"}, bias_rad_s};
  imu.angular_velocity += turned.angle() / (1e-9 * static_cast<double>(since_ns)) * turned.axis();
  for (double& value : imu.angular_velocity) value += kNoise_rad_s * noise_.gauss();
  imu.linear_acceleration = specific_force(T_map_base, stamp_ns);
  for (Bag& bag : bags_) bag.writer->write(bag.imu, stamp_ns, imu);
}

void BagOutput::close() {
  for (Bag& bag : bags_) bag.writer->close();
}

}  // namespace unimapper::apps
