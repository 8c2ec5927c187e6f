// Tests of the odometry's parameters and memory.
#include <catch2/catch.hpp>
#include <limits>
#include <string>

#include "scene.hpp"

using namespace unimapper;
using namespace unimapper::test;

TEST_CASE("the odometry takes exactly the bytes that it asks for, and at most 24 MB") {
  const std::size_t bytes = LidarOdometry::required_bytes({});
  CHECK(bytes > 0);
  CHECK(bytes <= 24U << 20U);
  const MemoryBlock memory(bytes);
  CHECK(LidarOdometry::create({}, memory.span()).ok());
  CHECK(LidarOdometry::create({}, memory.span().first(bytes - 1)).error().code ==
        ErrorCode::kMemoryTooSmall);
  const MemoryBlock more(bytes + 1);
  CHECK(LidarOdometry::create({}, more.span().subspan(1)).error().code ==
        ErrorCode::kMemoryMisaligned);
}

TEST_CASE("an odometry parameter out of its range is refused by name") {
  LidarOdometryConfig config;
  CHECK(config.validate().ok());
  config.voxel_m = std::numeric_limits<double>::quiet_NaN();
  CHECK(std::string(config.validate().message).find("voxel_m") != std::string::npos);
  CHECK(LidarOdometry::required_bytes(config) == 0);
  CHECK(LidarOdometry::create(config, {}).error().code == ErrorCode::kInvalidConfig);
  config = {};
  config.min_range_m = 20.0;
  config.max_range_m = 10.0;
  CHECK(std::string(config.validate().message).find("min_range_m") != std::string::npos);
}
