// Tests of the C interface of the odometry.

#include <catch2/catch.hpp>
#include <cstring>
#include <string>
#include <vector>

#include "tests/odometry/scene.hpp"
#include "unimapper_odometry.h"

using namespace unimapper;
using unimapper::test::kPeriod_ns;

namespace {

um_odometry_config defaults() {
  um_odometry_config config;
  REQUIRE(um_odometry_config_init(&config) == UM_OK);
  return config;
}

/// An odometry of the default configuration, in a block of its own.
struct Block {
  um_odometry_config config = defaults();
  MemoryBlock memory{um_odometry_required_bytes(&config)};
  um_odometry* odometry = nullptr;

  Block() {
    const char* message = nullptr;
    REQUIRE(um_odometry_init(&config, memory.data(), memory.span().size(), &odometry, &message) ==
            UM_OK);
    CHECK(std::string(message).empty());
  }
};

std::vector<Eigen::Vector3f> points_at(int scan) {
  return test::snapshot(test::hall(), test::level(0.3 * scan, 0.0, 0.02 * scan)).points;
}

um_points points_of(const std::vector<Eigen::Vector3f>& points) {
  return {points.data(), points.size(), sizeof(Eigen::Vector3f), 0, 4, 8};
}

}  // namespace

TEST_CASE("C's odometry has the bits of C++'s") {
  Block block;
  const LidarOdometryConfig config;
  const MemoryBlock memory(LidarOdometry::required_bytes(config));
  const auto created = LidarOdometry::create(config, memory.span());
  REQUIRE(created.ok());
  for (int i = 0; i < 4; ++i) {
    const std::vector<Eigen::Vector3f> scan = points_at(i);
    const um_points points = points_of(scan);
    for (int k = 0; k < 10; ++k) {
      const std::int64_t stamp_ns = i * kPeriod_ns + k * kPeriod_ns / 10;
      const double rad_s[3] = {0.01, 0.0, 0.2};
      const Eigen::Vector3d same(rad_s[0], rad_s[1], rad_s[2]);
      CHECK(um_odometry_add_angular_velocity(block.odometry, stamp_ns, rad_s) == UM_OK);
      CHECK(created.value()->add_angular_velocity(stamp_ns, same).ok());
      const double m_s2[3] = {0.1, 1.0, 9.7};
      CHECK(um_odometry_add_acceleration(block.odometry, stamp_ns, m_s2) == UM_OK);
      CHECK(created.value()->add_acceleration(stamp_ns, {0.1, 1.0, 9.7}).ok());
    }
    um_odometry_result c;
    REQUIRE(um_odometry_add_scan(block.odometry, &points, nullptr, i * kPeriod_ns, &c) == UM_OK);
    const OdometryResult cpp = created.value()->add_scan(
        i * kPeriod_ns, PointView::xyz(scan.data(), scan.size(), sizeof scan[0]), {});
    CHECK(c.state == static_cast<std::int32_t>(cpp.state));
    CHECK(c.T_odometry_sensor.m[3] == cpp.T_odometry_sensor.translation.x());
    CHECK(c.T_odometry_sensor.m[1] == cpp.T_odometry_sensor.rotation(0, 1));
    CHECK(c.velocity_m_s[0] == cpp.velocity_m_s.x());
    CHECK(c.angular_velocity_rad_s[2] == cpp.angular_velocity_rad_s.z());
    CHECK(c.covariance[6 * 5 + 4] == cpp.covariance(5, 4));
    CHECK(c.weak_axis_count == cpp.weak.count);
    double up[3];
    double sigma_rad = 0.0;
    REQUIRE(um_odometry_up(block.odometry, up, &sigma_rad) == UM_OK);
    CHECK(up[1] == cpp.up.y());
    CHECK(sigma_rad == cpp.up_sigma_rad);
    CHECK(std::string(c.reason) == cpp.reason);
    double slip[9];
    c.state = UM_ODOMETRY_LOST;
    REQUIRE(um_odometry_slip(&c, slip) == UM_OK);
    CHECK(slip[5] == cpp.covariance(1, 2));
  }
}

TEST_CASE("C's odometry refuses what cannot be, and says why") {
  Block block;
  const std::vector<Eigen::Vector3f> scan = points_at(0);
  const um_points points = points_of(scan);
  um_odometry_result result;
  REQUIRE(um_odometry_add_scan(block.odometry, &points, nullptr, 0, &result) == UM_OK);
  CHECK(um_odometry_add_scan(block.odometry, &points, nullptr, 0, &result) == UM_TIME_REVERSED);
  const um_points none = {nullptr, 0, 12, 0, 4, 8};
  CHECK(um_odometry_add_scan(block.odometry, &none, nullptr, 1, &result) == UM_EMPTY_SCAN);
  const um_points nowhere = {nullptr, 5, 12, 0, 4, 8};
  CHECK(um_odometry_add_scan(block.odometry, &nowhere, nullptr, 1, &result) == UM_INVALID_POINTS);
  CHECK(um_odometry_add_scan(block.odometry, nullptr, nullptr, 1, &result) == UM_NULL_ARGUMENT);
  CHECK(um_odometry_add_scan(block.odometry, &points, nullptr, 1, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_odometry_add_scan(nullptr, &points, nullptr, 1, &result) == UM_INVALID_HANDLE);
}

TEST_CASE("C's odometry takes a configuration that is possible and memory that is enough") {
  Block block;
  um_odometry* odometry = block.odometry;
  const char* message = nullptr;
  const std::size_t bytes = block.memory.span().size();
  CHECK(um_odometry_init(&block.config, block.memory.data(), bytes - 1, &odometry, &message) ==
        UM_MEMORY_TOO_SMALL);
  CHECK(odometry == nullptr);
  CHECK(um_odometry_init(&block.config, block.memory.data() + 1, bytes, &odometry, &message) ==
        UM_MEMORY_MISALIGNED);
  CHECK(um_odometry_init(&block.config, nullptr, bytes, &odometry, &message) == UM_NULL_ARGUMENT);
  um_odometry_config wrong = block.config;
  wrong.voxel_m = -1.0;
  CHECK(um_odometry_required_bytes(&wrong) == 0);
  CHECK(um_odometry_init(&wrong, block.memory.data(), bytes, &odometry, &message) ==
        UM_INVALID_CONFIG);
  CHECK(std::string(message).find("voxel_m") != std::string::npos);
  CHECK(um_odometry_config_init(nullptr) == UM_NULL_ARGUMENT);
}
