// Tests of trajectory, time and calibration files.
#include "ports/datasets/poses.hpp"
#include "ports/datasets/text_encoding.hpp"
#include "tests/ports/datasets/fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

Trajectory trajectory_of(std::string_view text) { return parse_trajectory(text, "poses.txt"); }

std::vector<std::int64_t> times_of(std::string_view text) { return parse_times(text, "times.txt"); }

/// The only pose of `text`, applied to (1, 0, 0).
Eigen::Vector3d moved_point(const std::string& text) {
  INFO(text);
  const auto poses = trajectory_of(text).poses;
  REQUIRE(poses.size() == 1);
  return poses[0] * Eigen::Vector3d(1, 0, 0);
}

}  // namespace

TEST_CASE("a TUM line is a stamp, a position and a quaternion with w last") {
  const std::string text =
      "# t x y z qx qy qz qw\n\n1691936557.946849179 1 2 3 0 0 0.7071068 0.7071068\r\n";
  CHECK(moved_point(text).isApprox(Eigen::Vector3d(1, 3, 3), 1e-6));
  CHECK(trajectory_of(text).stamps_ns == std::vector<std::int64_t>{1691936557946849179});
}

TEST_CASE("commas separate columns without a header, stamps in nanoseconds keep every digit") {
  const Trajectory trajectory = trajectory_of("0,1,2,3,0,0,0,1\n1,4,5,6,0,0,0,1");
  REQUIRE(trajectory.poses.size() == 2);
  CHECK(trajectory.poses[1].translation == Eigen::Vector3d(4, 5, 6));
  CHECK(trajectory.stamps_ns == std::vector<std::int64_t>{0, 1'000'000'000});
  const std::string aeva = "1691936557946849179 0 0 0 0 0 0 1\n";
  CHECK(parse_trajectory(aeva, "Aeva_gt.txt", StampUnit::kNanoseconds).stamps_ns ==
        std::vector<std::int64_t>{1691936557946849179});
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

TEST_CASE("rotations printed with few digits become exact rotations") {
  const auto trajectory = trajectory_of(
      "0.999979 0.005001 0.004032 -0.000948 -0.004994 0.999986 -0.001766 -0.004086 "
      "-0.004041 0.001746 0.99999 -0.002842\n");
  CHECK(trajectory.poses.at(0).is_rigid(1e-12));
}

TEST_CASE("a pose that cannot be one is refused with its line") {
  check_refusals(
      {{"1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 nan 0 1 0 0 0 0 1 0\n", {"poses.txt:2", "not finite"}},
       {"1 0 0 inf 0 1 0 0 0 0 1 0\n", {"not finite"}},
       {"2 0 0 0 0 1 0 0 0 0 1 0\n", {"not a rotation"}},
       {"1 0 0 0 0 1 0 0 0 0 -1 0\n", {"not a rotation"}},
       {"0 0 0 0 0 0 0 0 0 0 0 0\n", {"not a rotation"}},
       {"0 0 0 0 0 0 0 0\n", {"length 1"}},
       {"0 0 0 0 0 0 0 nan\n", {"not finite"}},
       {"1 0 0 0 0 1 0 0 0 0 1\n", {"found 11"}},
       {"0 1 2 3 0 0 0 1\n1 0 0 0 0 1 0 0 0 0 1 0\n", {"poses.txt:2", "expected 8"}},
       {"1 0 0 zero 0 1 0 0 0 0 1 0\n", {"'zero' is not a number"}},
       {"1e20 0 0 0 0 0 0 1\n", {"out of range"}},
       {"0 1 0 0 -1 0 0 0 0 0 1 0 10 20 30 1\n", {"by columns"}},
       {"1 0 0 0\n0 1 0 0\n0 0 1 0\n", {"fewer than four rows"}},
       {"1 0 0 0\n1 0 0 0 0 1 0 0 0 0 1 0\n", {"poses.txt:2"}}},
      trajectory_of);
}

TEST_CASE("matrices by rows, 3x4 or 4x4, are poses, on one line or on four, or behind a stamp") {
  const std::string matrix = "0 -1 0 10 1 0 0 20 0 0 1 30 0 0 0 1";
  const auto check = [&](const std::string& text, std::size_t stamps) {
    CHECK(moved_point(text).isApprox(Eigen::Vector3d(10, 21, 30)));
    CHECK(trajectory_of(text).stamps_ns.size() == stamps);
  };
  check("0 -1 0 10 1 0 0 20 0 0 1 30\n", 0);
  check(matrix + "\n", 0);
  check("5.5 " + matrix + "\n", 1);
  check("0 -1 0 10\n1 0 0 20\n0 0 1 30\n0 0 0 1\n", 0);
  check("1691936557946849179 0 -1 0 10 1 0 0 20 0 0 1 30\n", 1);
}

TEST_CASE("a header names the columns, also as a comment, whatever their order is") {
  const std::string header = GENERATE(
      "timestamp,tx,ty,tz,qw,qx,qy,qz", "# timestamp x y z qw qx qy qz",
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z "
      "[]",
      "%time,pose.position.x,pose.position.y,pose.position.z,pose.orientation.w,"
      "pose.orientation.x,pose.orientation.y,pose.orientation.z");
  const std::string text = header + "\n1691936557946849179,1,2,3,0.7071068,0,0,0.7071068\n";
  CHECK(moved_point(text).isApprox(Eigen::Vector3d(1, 3, 3), 1e-6));
  CHECK(trajectory_of(text).stamps_ns == std::vector<std::int64_t>{1691936557946849179});
}

TEST_CASE("lines that hold no pose are left out: comments, stamps of a lost tracker") {
  const Trajectory found = trajectory_of(
      "// by a mapper\n% t x y z qx qy qz qw\n1 1 2 3 0 0 0 1\n2 nan nan nan nan nan nan nan\n"
      "3,,,,,,,\n4 5 6 7 0 0 0 1\n");
  CHECK(found.stamps_ns == std::vector<std::int64_t>{1'000'000'000, 4'000'000'000});
  CHECK(found.poses.size() == 2);
  CHECK(found.not_finite == 2);
}

TEST_CASE("seconds and nanoseconds of a stamp may be two columns") {
  const std::string header = GENERATE("sec,nsec", "header.stamp.sec,header.stamp.nanosec");
  CHECK(
      trajectory_of(header + ",x,y,z,qx,qy,qz,qw\n1691936557,46849179,1,2,3,0,0,0,1\n").stamps_ns ==
      std::vector<std::int64_t>{1691936557046849179});
}

TEST_CASE("a pose file that is compressed is refused with what unpacks it") {
  const TemporaryDirectory directory;
  CHECK_THAT(error_of([&] { (void)read_text(directory.write("poses.txt", "\x1f\x8b\x08")); }),
             Contains("gunzip"));
}

TEST_CASE("what is not a pose is refused with what is accepted") {
  for (const auto& [text, reason] :
       {std::pair("1 2 3 4 0.1 0.2 0.3\n", "angles"), std::pair("1 2 3 0.1 0.2\n", "angles"),
        std::pair("1 2 3 0.1\n2 2 3 0.1\n3 2 3 0.1\n4 2 3 0.1\n", "angle or a stamp"),
        std::pair("time,x,y,z,roll,pitch,yaw\n1,2,3,4,0.1,0.2,0.3\n", "angles"),
        std::pair("t x y z\n", "'t' is not a number"),
        std::pair("1 2 3 4 0.1 0.2 0.3 0.4\n", "but 0.54"),
        // Two columns of the same meaning leave it open.
        std::pair("t x x y z qx qy qz qw\n", "'t' is not a number")}) {
    check_refusals({{text, {reason, "accepted are TUM", "KITTI"}}}, trajectory_of);
  }
}

TEST_CASE("the log of FAST-LIO is named and refused, whatever its version writes") {
  for (const int columns : {20, 25}) {
    std::string line = "0.100000";
    for (int i = 1; i < columns; ++i) line += " 0.010000";
    CHECK_THROWS_WITH(parse_trajectory(line + "\r\n", "drive/pos_log.txt"),
                      Contains("log of FAST-LIO") && Contains("poses_tum.txt"));
  }
  CHECK(parse_trajectory("0.1 1 2 3 0 0 0 1\n", "pos_log.txt").poses.size() == 1);
}

TEST_CASE("whole stamps are in the unit that their size says") {
  const std::string pose = " 0 0 0 0 0 0 1\n";
  for (const auto& [first, second] :
       {std::pair("1691936557000000000", "1691936557010000000"),
        std::pair("1691936557000000", "1691936557010000"),
        std::pair("1691936557000", "1691936557010"), std::pair("1691936557", "1691936557.01")}) {
    CHECK(trajectory_of(first + pose + second + pose).stamps_ns ==
          std::vector<std::int64_t>{1691936557000000000, 1691936557010000000});
  }
}

TEST_CASE("times are exact to the nanosecond when written plainly, or dates") {
  CHECK(times_of("0\n0.1\n1691936557.946849179\n-0.5\n1.000000e-01\n2.5e+01\n") ==
        std::vector<std::int64_t>{0, 100'000'000, 1691936557946849179, -500'000'000, 100'000'000,
                                  25'000'000'000});
  CHECK(times_of("2011-09-26 13:02:25.951199337\n2011-09-26 13:02:26\n") ==
        std::vector<std::int64_t>{1317042145951199337, 1317042146000000000});
}

TEST_CASE("times that are not times are refused with their line") {
  check_refusals({{"0.1\nnan\n", {"times.txt:2", "not finite"}},
                  {"0.1 0.2\n", {"one time in seconds per line"}},
                  {"2011-13-26 13:02:25\n", {"one time in seconds"}},
                  {"1e300\n", {"out of range"}},
                  {"99999999999999999999\n", {"out of range"}},
                  {"-\n", {"not a number"}}},
                 times_of);
}

TEST_CASE("control characters of a garbage file do not reach the terminal") {
  const auto message = error_of([] { trajectory_of("\x1b[31m 0 0 0 0 0 0 1\n"); });
  CHECK(message.find('\x1b') == std::string::npos);
}

TEST_CASE("a calibration file may lack the line of the LiDAR") {
  CHECK_FALSE(parse_calibration("P0: 1 0 0 0 0 1 0 0 0 0 1 0\n", "calib.txt"));
  CHECK_THAT(error_of([] { (void)parse_calibration("Tr: 1 0 0\n", "calib.txt"); }),
             Contains("calib.txt:1") && Contains("12 values"));
}
