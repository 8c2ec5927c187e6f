// Tests of the tree of coordinate frames and of poses by stamp.
#include "ports/datasets/bag/transform_tree.hpp"

#include <catch2/catch.hpp>

using namespace unimapper;
using namespace unimapper::datasets::bag;

namespace {

constexpr std::int64_t kMillisecond = 1'000'000;

Pose at_x(double x) { return {Eigen::Matrix3d::Identity(), Eigen::Vector3d(x, 0, 0)}; }

/// A robot that drives along x at 10 m/s, its LiDAR turned left and above it.
TransformTree driving_robot() {
  TransformTree tree;
  const Pose T_base_lidar{
      Eigen::Quaterniond(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d(0, 0, 2)};
  tree.add("base", "lidar", 0, T_base_lidar, true);
  for (int i = 0; i <= 10; ++i) {
    tree.add("odom", "base", i * 100 * kMillisecond, at_x(i), false);
  }
  for (int i = 0; i <= 1; ++i) {
    tree.add("map", "odom", i * 1000 * kMillisecond, at_x(100 + 0.1 * i), false);
  }
  tree.finish();
  return tree;
}

}  // namespace

TEST_CASE(
    "poses up to half a second apart are interpolated, and farther ones if they are the same") {
  PoseSeries series;
  series.add(501 * kMillisecond, at_x(1));
  series.add(0, at_x(0));
  series.add(601 * kMillisecond, at_x(2));
  series.add(5000 * kMillisecond, at_x(2));
  series.finish();
  CHECK_FALSE(series.at(250 * kMillisecond).has_value());
  CHECK(series.at(526 * kMillisecond)->translation.x() == Approx(1.25));
  CHECK(series.at(601 * kMillisecond)->translation.x() == 2.0);
  CHECK(series.at(3000 * kMillisecond)->translation.x() == 2.0);
  CHECK_FALSE(series.at(-1).has_value());
  CHECK_FALSE(series.at(5000 * kMillisecond + 1).has_value());
}

TEST_CASE("a pose that repeats is kept twice") {
  PoseSeries series;
  for (int i = 0; i < 1000; ++i) series.add(i * 1000 * kMillisecond, at_x(3));
  series.finish();
  CHECK(series.is_constant());
  CHECK(series.first_ns() == 0);
  CHECK(series.last_ns() == 999'000 * kMillisecond);
  CHECK(series.at(123'456 * kMillisecond)->translation.x() == Approx(3.0));
}

TEST_CASE("a frame's pose is found along the chain of its parents") {
  const TransformTree tree = driving_robot();
  const auto T_odom_lidar = tree.lookup("odom", "lidar", 250 * kMillisecond);
  REQUIRE(T_odom_lidar.has_value());
  CHECK((*T_odom_lidar * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(2.5, 1, 2), 1e-12));
  const auto T_lidar_odom = tree.lookup("lidar", "odom", 250 * kMillisecond);
  CHECK((*T_lidar_odom * *T_odom_lidar).translation.norm() < 1e-12);
  CHECK(tree.ancestors("lidar") == std::vector<std::string>{"lidar", "base", "odom", "map"});
}

TEST_CASE("a static transform holds at any time, a moving one while it was published") {
  const TransformTree tree = driving_robot();
  CHECK(tree.lookup("base", "lidar", 999'999 * kMillisecond).has_value());
  CHECK_FALSE(tree.lookup("odom", "lidar", 1001 * kMillisecond).has_value());
  CHECK(tree.moves("odom", "lidar"));
  CHECK_FALSE(tree.moves("base", "lidar"));
  CHECK(tree.is_rigid("base", "lidar"));
  CHECK(tree.is_rigid("lidar", "base"));
  CHECK_FALSE(tree.is_rigid("odom", "lidar"));
  // Frames without a common ancestor are not connected.
  CHECK_FALSE(tree.is_rigid("camera", "lidar"));
  CHECK_FALSE(tree.is_connected("lidar", "camera"));
  CHECK_FALSE(tree.lookup("camera", "lidar", 0).has_value());
  CHECK(tree.is_connected("base", "map"));
}

TEST_CASE("frames that are each other's parents do not hang the search") {
  TransformTree tree;
  tree.add("a", "b", 0, Pose(), true);
  tree.add("b", "a", 0, Pose(), true);
  tree.finish();
  CHECK(tree.ancestors("a").size() <= 4);
  CHECK_FALSE(tree.lookup("c", "a", 0).has_value());
}

TEST_CASE("of a frame with several parents the first one counts, and it is named") {
  TransformTree tree;
  tree.add("odom", "base", 0, at_x(1), false);
  tree.add("map", "base", 0, at_x(2), false);
  tree.finish();
  CHECK(tree.lookup("odom", "base", 0)->translation.x() == 1.0);
  CHECK(tree.ambiguous_frames() == std::vector<std::string>{"base"});
}
