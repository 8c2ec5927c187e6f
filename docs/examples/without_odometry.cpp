// Without odometry: poses from the scans alone.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unimapper/core/owned.hpp>
#include <unimapper/odometry/odometry.hpp>
#include <vector>

using namespace unimapper;

/// What a LiDAR of 32 rings sees in a hall of 40 x 24 x 6 m, `x` metres along it.
std::vector<Eigen::Vector3f> hall(float x) {
  std::vector<Eigen::Vector3f> scan;
  for (int i = 0; i < 32 * 360; ++i) {
    const float a = 0.0175F * (i % 360) + 0.001F, e = 0.02F * (i / 360) - 0.3F;
    const Eigen::Vector3f ray(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e));
    const float to_x = (ray.x() > 0 ? 25 - x : 15 + x) / std::fabs(ray.x());
    const float range = std::min({to_x, 12 / std::fabs(ray.y()), 3 / std::fabs(ray.z())});
    scan.push_back(range * ray);
  }
  return scan;
}

int main() {
  const LidarOdometryConfig config;
  MemoryBlock memory(LidarOdometry::required_bytes(config));  // or a block of your own
  const Expected<LidarOdometry*> odometry = LidarOdometry::create(config, memory.span());
  if (!odometry.ok()) return 1;
  for (std::int64_t k = 0; k < 6; ++k) {
    const std::vector<Eigen::Vector3f> scan = hall(0.5F * k);
    const PointView points = PointView::xyz(scan.data(), scan.size(), sizeof scan[0]);
    // Third: when each point was measured, seconds after the stamp; here all at once.
    const OdometryResult found = (*odometry)->add_scan(k * 100'000'000, points, {});
    if (!found.error.ok() || found.state == OdometryState::kLost) continue;  // found.reason
    // pipeline->add_slip(slip_of(found));  // what no scan has determined, for the base
    // pipeline->add_scan(points, found.T_odometry_sensor, k * 100'000'000);
    std::printf("%.1f m ahead\n", found.T_odometry_sensor.translation.x());
  }
}
