// Tests of trajectory, time and calibration files.
#include <catch2/catch.hpp>

#include "ports/datasets/poses.hpp"
#include "ports/datasets/text_encoding.hpp"
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

TEST_CASE("text of other programs becomes plain: encodings, line breaks, decimal commas") {
  const std::string plain = "1.5 2 3 4 0 0 0 1\n";
  const auto utf16 = [&](bool is_big_endian) {
    std::string bytes;
    for (const char c : plain) {
      bytes += is_big_endian ? std::string{'\0', c} : std::string{c, '\0'};
    }
    return bytes;
  };
  CHECK(plain_text("\xef\xbb\xbf" + plain) == plain);
  CHECK(plain_text("\xff\xfe" + utf16(false)) == plain);
  CHECK(plain_text("\xfe\xff" + utf16(true)) == plain);
  CHECK(plain_text(utf16(false)) == plain);
  CHECK(plain_text("1 2\r3 4\r") == "1 2\n3 4\n");
  CHECK(plain_text("t;x;y, m\n0,5;-1,25;3\n") == "t;x;y. m\n0.5;-1.25;3\n");
  CHECK(plain_text("\"0,5\";\"1,5\"\n") == "\"0.5\";\"1.5\"\n");
  CHECK(plain_text("0,5\t1,5e-3\n") == "0.5\t1.5e-3\n");
  CHECK(plain_text("0,100\n0,200\n") == "0.100\n0.200\n");
  // Commas between columns stay.
  for (const char* text : {"0,1,2\n", "0, 1, 2\n", "0,1.5 2\n", "1,2,3 4,5,6\n", "0,1\n0,1,2\n",
                           "7,1691936557946849179\n"}) {
    CHECK(plain_text(text) == text);
  }
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

TEST_CASE("4x4 matrices by rows are poses, on one line or on four, and behind a stamp") {
  const std::string matrix = "0 -1 0 10 1 0 0 20 0 0 1 30 0 0 0 1";
  const Eigen::Vector3d expected(10, 21, 30);
  const auto check = [&](const std::string& text, std::size_t stamps) {
    INFO(text);
    const auto trajectory = parse_trajectory(text, "poses.txt");
    REQUIRE(trajectory.poses.size() == 1);
    CHECK((trajectory.poses[0] * Eigen::Vector3d(1, 0, 0)).isApprox(expected));
    CHECK(trajectory.stamps_ns.size() == stamps);
  };
  check(matrix + "\n", 0);
  check("5.5 " + matrix + "\n", 1);
  check("0 -1 0 10\n1 0 0 20\n0 0 1 30\n0 0 0 1\n", 0);
  check("1691936557946849179 0 -1 0 10 1 0 0 20 0 0 1 30\n", 1);
  CHECK_THAT(trajectory_error("0 1 0 0 -1 0 0 0 0 0 1 0 10 20 30 1\n"), Contains("by columns"));
  CHECK_THAT(trajectory_error("1 0 0 0\n0 1 0 0\n0 0 1 0\n"), Contains("fewer than four rows"));
  CHECK_THAT(trajectory_error("1 0 0 0\n1 0 0 0 0 1 0 0 0 0 1 0\n"), Contains("poses.txt:2"));
}

TEST_CASE("a header names the columns, also as a comment, whatever their order is") {
  const std::string header = GENERATE(
      "timestamp,tx,ty,tz,qw,qx,qy,qz", "# timestamp x y z qw qx qy qz",
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z "
      "[]",
      "%time,pose.position.x,pose.position.y,pose.position.z,pose.orientation.w,"
      "pose.orientation.x,pose.orientation.y,pose.orientation.z");
  INFO(header);
  const auto trajectory = parse_trajectory(
      header + "\n1691936557946849179,1,2,3,0.7071068,0,0,0.7071068\n", "poses.csv");
  REQUIRE(trajectory.poses.size() == 1);
  CHECK(trajectory.stamps_ns == std::vector<std::int64_t>{1691936557946849179});
  CHECK((trajectory.poses[0] * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 3, 3), 1e-6));
}

TEST_CASE("what is not a pose is refused with what is accepted") {
  const auto check = [](std::string_view text, const std::string& reason) {
    CHECK_THAT(trajectory_error(text),
               Contains(reason) && Contains("accepted are TUM") && Contains("KITTI"));
  };
  check("1 2 3 4 0.1 0.2 0.3\n", "angles");
  check("time,x,y,z,roll,pitch,yaw\n1,2,3,4,0.1,0.2,0.3\n", "angles");
  check("t x y z\n", "'t' is not a number");
  check("1 2 3 4 0.1 0.2 0.3 0.4\n", "but 0.54");
  // Two columns of the same meaning leave it open.
  check("t x x y z qx qy qz qw\n", "'t' is not a number");
}

TEST_CASE("whole stamps are in the unit that their size says") {
  const auto stamps = [](const std::string& first, const std::string& second) {
    return parse_trajectory(first + " 0 0 0 0 0 0 1\n" + second + " 0 0 0 0 0 0 1\n", "p.txt")
        .stamps_ns;
  };
  const std::vector<std::int64_t> expected = {1691936557000000000, 1691936557010000000};
  CHECK(stamps("1691936557000000000", "1691936557010000000") == expected);
  CHECK(stamps("1691936557000000", "1691936557010000") == expected);
  CHECK(stamps("1691936557000", "1691936557010") == expected);
  CHECK(stamps("1691936557", "1691936557.01") == expected);
}

TEST_CASE("dates are times, too") {
  CHECK(parse_times("2011-09-26 13:02:25.951199337\n2011-09-26 13:02:26\n", "timestamps.txt") ==
        std::vector<std::int64_t>{1317042145951199337, 1317042146000000000});
  CHECK_THAT(error_of([] { (void)parse_times("2011-13-26 13:02:25\n", "timestamps.txt"); }),
             Contains("one time in seconds"));
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
