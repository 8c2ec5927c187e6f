// Tests of trajectory, time and calibration files.
#include <catch2/catch.hpp>

#include "ports/datasets/poses.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

std::string trajectory_error(std::string_view text) {
  return error_of([&] { (void)parse_trajectory(text, "poses.txt"); });
}

}  // namespace

TEST_CASE("a KITTI line is a row-major 3x4 matrix") {
  const auto trajectory = parse_trajectory("0 -1 0 10 1 0 0 20 0 0 1 30\n", "poses.txt");
  REQUIRE(trajectory.poses.size() == 1);
  CHECK(trajectory.stamps_ns.empty());
  const Eigen::Vector3d p = trajectory.poses[0] * Eigen::Vector3d(1, 0, 0);
  CHECK(p.isApprox(Eigen::Vector3d(10, 21, 30)));
}

TEST_CASE("a TUM line is a stamp, a position and a quaternion with w last") {
  const auto trajectory = parse_trajectory(
      "# t x y z qx qy qz qw\n\n1691936557.946849179 1 2 3 0 0 0.7071068 0.7071068\r\n",
      "poses.txt");
  REQUIRE(trajectory.poses.size() == 1);
  CHECK(trajectory.stamps_ns == std::vector<std::int64_t>{1691936557946849179});
  const Eigen::Vector3d p = trajectory.poses[0] * Eigen::Vector3d(1, 0, 0);
  CHECK(p.isApprox(Eigen::Vector3d(1, 3, 3), 1e-6));
}

TEST_CASE("commas separate columns as well as blanks do") {
  const auto trajectory = parse_trajectory("0,1,2,3,0,0,0,1\n1,4,5,6,0,0,0,1", "poses.csv");
  REQUIRE(trajectory.poses.size() == 2);
  CHECK(trajectory.poses[1].translation == Eigen::Vector3d(4, 5, 6));
  CHECK(trajectory.stamps_ns == std::vector<std::int64_t>{0, 1'000'000'000});
}

TEST_CASE("stamps in nanoseconds keep every digit") {
  const auto trajectory = parse_trajectory("1691936557946849179 0 0 0 0 0 0 1\n", "Aeva_gt.txt",
                                           StampUnit::kNanoseconds);
  CHECK(trajectory.stamps_ns == std::vector<std::int64_t>{1691936557946849179});
}

TEST_CASE("rotations printed with few digits become exact rotations") {
  const auto trajectory = parse_trajectory(
      "0.999979 0.005001 0.004032 -0.000948 -0.004994 0.999986 -0.001766 -0.004086 "
      "-0.004041 0.001746 0.99999 -0.002842\n",
      "poses.txt");
  CHECK(trajectory.poses.at(0).is_rigid(1e-12));
}

TEST_CASE("a pose that cannot be one is refused with its line") {
  CHECK_THAT(trajectory_error("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 nan 0 1 0 0 0 0 1 0\n"),
             Contains("poses.txt:2") && Contains("not finite"));
  CHECK_THAT(trajectory_error("1 0 0 inf 0 1 0 0 0 0 1 0\n"), Contains("not finite"));
  CHECK_THAT(trajectory_error("2 0 0 0 0 1 0 0 0 0 1 0\n"), Contains("not a rotation"));
  CHECK_THAT(trajectory_error("1 0 0 0 0 1 0 0 0 0 -1 0\n"), Contains("not a rotation"));
  CHECK_THAT(trajectory_error("0 0 0 0 0 0 0 0 0 0 0 0\n"), Contains("not a rotation"));
  CHECK_THAT(trajectory_error("0 0 0 0 0 0 0 0\n"), Contains("length 1"));
  CHECK_THAT(trajectory_error("0 0 0 0 0 0 0 nan\n"), Contains("not finite"));
  CHECK_THAT(trajectory_error("1 0 0 0 0 1 0 0 0 0 1\n"), Contains("found 11"));
  CHECK_THAT(trajectory_error("0 1 2 3 0 0 0 1\n1 0 0 0 0 1 0 0 0 0 1 0\n"),
             Contains("poses.txt:2") && Contains("expected 8"));
  CHECK_THAT(trajectory_error("1 0 0 zero 0 1 0 0 0 0 1 0\n"), Contains("'zero' is not a number"));
  CHECK_THAT(trajectory_error("1e20 0 0 0 0 0 0 1\n"), Contains("out of range"));
}

TEST_CASE("control characters of a garbage file do not reach the terminal") {
  const std::string message = trajectory_error("\x1b[31m 0 0 0 0 0 0 1\n");
  CHECK(message.find('\x1b') == std::string::npos);
}

TEST_CASE("times are exact to the nanosecond when written plainly") {
  const auto stamps_ns =
      parse_times("0\n0.1\n1691936557.946849179\n-0.5\n1.000000e-01\n2.5e+01\n", "times.txt");
  CHECK(stamps_ns == std::vector<std::int64_t>{0, 100'000'000, 1691936557946849179, -500'000'000,
                                               100'000'000, 25'000'000'000});
}

TEST_CASE("times that are not times are refused with their line") {
  const auto error = [](std::string_view text) {
    return error_of([&] { (void)parse_times(text, "times.txt"); });
  };
  CHECK_THAT(error("0.1\nnan\n"), Contains("times.txt:2") && Contains("not finite"));
  CHECK_THAT(error("0.1 0.2\n"), Contains("one time in seconds per line"));
  CHECK_THAT(error("1e300\n"), Contains("out of range"));
  CHECK_THAT(error("99999999999999999999\n"), Contains("out of range"));
  CHECK_THAT(error("-\n"), Contains("not a number"));
}

TEST_CASE("a calibration file may lack the line of the LiDAR") {
  CHECK_FALSE(parse_calibration("P0: 1 0 0 0 0 1 0 0 0 0 1 0\n", "calib.txt"));
  CHECK_THAT(error_of([] { (void)parse_calibration("Tr: 1 0 0\n", "calib.txt"); }),
             Contains("calib.txt:1") && Contains("12 values"));
}
