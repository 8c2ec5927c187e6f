// Tests of PCD files and sequences of them.
#include "ports/datasets/pcd.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "tests/ports/datasets/pcd_fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

Scan parse(const std::string& bytes) {
  Scan scan;
  parse_pcd(bytes, "cloud.pcd", scan);
  return scan;
}

std::string parse_error(const std::string& bytes) {
  return error_of([&] { (void)parse(bytes); });
}

void check_two_points(const Scan& scan) {
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[0] == Eigen::Vector3f(1, 2, 3));
  CHECK(scan.view()[1] == Eigen::Vector3f(1, 2, 3));
}

}  // namespace

TEST_CASE("ascii clouds may hold NaN, further fields and blank lines") {
  const Scan scan = parse(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS ring x y z intensity\n"
      "SIZE 2 4 4 4 4\nTYPE U F F F F\nCOUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n7 1 -2.5 3e0 12\r\n\n7 nan nan nan 0\n");
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.5F, 3.0F));
  CHECK(scan.points[0].intensity == 12.0F);
  CHECK(std::isnan(scan.points[1].x));
}

TEST_CASE("binary clouds skip padding, repeated counts and other types") {
  // u16 ring, 2 x 3 bytes of padding, f64 x, f32 y, i16 z, u8 i
  const Scan scan = parse(
      "VERSION .7\nFIELDS ring _ x y z i\nSIZE 2 1 8 4 2 1\nTYPE U U F F I U\n"
      "COUNT 1 6 1 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary\n" +
      hex("0700 aaaaaaaaaaaa 000000000000f03f 00000040 fdff c8"));
  REQUIRE(scan.points.size() == 1);
  CHECK(scan.view()[0] == Eigen::Vector3f(1, 2, -3));
  CHECK(scan.points[0].intensity == 200.0F);
}

TEST_CASE("compressed clouds hold all x, then all y, then all z") {
  check_two_points(parse(compressed_cloud()));
}

TEST_CASE("fields of several values before x, y and z are skipped, compressed or not") {
  const std::string header =
      "FIELDS normal x y z\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 2 1 1 1\nPOINTS 2\nDATA ";
  const std::string one = "0000803f", two = "00000040", three = "00004040", nine = "00001041";
  check_two_points(parse(header + "ascii\n9 9 1 2 3\n9 9 1 2 3\n"));
  check_two_points(parse(header + "binary\n" + hex(nine + nine + one + two + three) +
                         hex(nine + nine + one + two + three)));
  // Literal runs of eight bytes: four values of `normal`, then x, y and z of both points.
  check_two_points(parse(header + "binary_compressed\n" + hex("2d000000 28000000") +
                         hex("07" + nine + nine + "07" + nine + nine + "07" + one + one) +
                         hex("07" + two + two + "07" + three + three)));
}

TEST_CASE("fields of several values are read by their first value") {
  // As drivers do that store x and its error in one field.
  const std::string header = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 2 1 1\nPOINTS 2\nDATA ";
  const std::string one = "0000803f", two = "00000040", three = "00004040", nine = "00001041";
  check_two_points(parse(header + "ascii\n1 9 2 3\n1 9 2 3\n"));
  check_two_points(
      parse(header + "binary\n" + hex(one + nine + two + three) + hex(one + nine + two + three)));
  check_two_points(parse(header + "binary_compressed\n" + hex("24000000 20000000") +
                         hex("07" + one + nine + "07" + one + nine + "07" + two + two) +
                         hex("07" + three + three)));
}

TEST_CASE("old headers lack COUNT, VIEWPOINT and POINTS") {
  const std::string header =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA ascii\n";
  check_two_points(parse(header + "1 2 3\n1 2 3\n"));
}

TEST_CASE("the viewpoint is a position and a quaternion with w first") {
  const PcdHeader header = parse_pcd_header(binary_cloud("10 20 30 0.7071068 0 0 0.7071068"), "a");
  REQUIRE(header.viewpoint);
  CHECK((*header.viewpoint * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(10, 21, 30), 1e-6));
  CHECK_FALSE(parse_pcd_header(binary_cloud("0 0 0 0 0 0 0"), "a").viewpoint);
  CHECK_FALSE(parse_pcd_header(binary_cloud("nan 0 0 1 0 0 0"), "a").viewpoint);
}

TEST_CASE("damaged clouds are refused with file, position and reason") {
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\n";
  CHECK_THAT(parse_error(""), Contains("cloud.pcd: offset 0") && Contains("DATA"));
  CHECK_THAT(parse_error("garbage\n"), Contains("cloud.pcd:1") && Contains("not a PCD file"));
  CHECK_THAT(parse_error(std::string(100, '\n')), Contains("no DATA line"));
  CHECK_THAT(parse_error("DATA ascii\n"), Contains("no FIELDS"));
  CHECK_THAT(parse_error("SIZE 4\nDATA ascii\n"), Contains("before FIELDS"));
  CHECK_THAT(parse_error("FIELDS x y z\nSIZE 4 4\nDATA ascii\n"), Contains("2 values for 3"));
  CHECK_THAT(parse_error("FIELDS x\nSIZE 3\nDATA ascii\n"), Contains("SIZE must be"));
  CHECK_THAT(parse_error("FIELDS x\nSIZE 2\nTYPE F\nWIDTH 0\nDATA ascii\n"), Contains("float"));
  CHECK_THAT(parse_error("FIELDS x\nTYPE Q\nDATA ascii\n"), Contains("TYPE must be"));
  CHECK_THAT(parse_error("FIELDS x\nCOUNT 4294967296\nDATA ascii\n"), Contains("COUNT"));
  CHECK_THAT(parse_error("FIELDS x\nPOINTS -1\nDATA ascii\n"), Contains("POINTS"));
  CHECK_THAT(parse_error("FIELDS x\nDATA ascii\n"), Contains("neither POINTS nor WIDTH"));
  CHECK_THAT(parse_error("FIELDS x y\nWIDTH 1\nDATA ascii\n1 2\n"), Contains("x, y and z"));
  CHECK_THAT(parse_error(fields + "DATA smoke\n"), Contains("DATA must be"));
  CHECK_THAT(parse_error(fields + "DATA ascii\n1 2 3\n"), Contains("2 points announced, 1"));
  CHECK_THAT(parse_error(fields + "DATA ascii\n1 2\n"), Contains("cloud.pcd:7"));
  CHECK_THAT(parse_error(fields + "DATA ascii\n1 2 z\n"), Contains("not a number"));
  CHECK_THAT(parse_error(fields + "DATA binary\n12345678901234567890123"),
             Contains("truncated") && Contains("2 points of 12 bytes") && Contains("1 are there"));
}

TEST_CASE("floats have four or eight bytes, integers any number of them that is a power of two") {
  const auto header = [](const std::string& size, const std::string& type) {
    return "FIELDS x y z s\nSIZE 4 4 4 " + size + "\nTYPE F F F " + type +
           "\nWIDTH 0\nDATA binary\n";
  };
  for (const std::string size : {"1", "2"}) {
    CHECK_THAT(parse_error(header(size, "F")), Contains("field s is a float of fewer than 4"));
  }
  for (const std::string size : {"4", "8"}) CHECK(parse(header(size, "F")).points.empty());
  for (const std::string size : {"1", "2", "4", "8"}) {
    CHECK(parse(header(size, "U")).points.empty());
    CHECK(parse(header(size, "I")).points.empty());
  }
  for (const std::string size : {"0", "3", "5", "16"}) {
    CHECK_THAT(parse_error(header(size, "U")), Contains("SIZE must be 1, 2, 4 or 8"));
  }
}

TEST_CASE("a header has up to 64 lines and names up to 64 fields") {
  const auto with_comments = [](int count) {
    std::string header;
    for (int i = 0; i < count; ++i) header += "# comment\n";
    return header + "FIELDS x y z\nWIDTH 0\nDATA ascii\n";
  };
  CHECK(parse(with_comments(61)).points.empty());
  CHECK_THAT(parse_error(with_comments(62)), Contains("no DATA line"));
  const auto with_fields = [](int count) {
    std::string header = "FIELDS x y z";
    for (int i = 3; i < count; ++i) header += " f" + std::to_string(i);
    return header + "\nWIDTH 0\nDATA ascii\n";
  };
  CHECK(parse(with_fields(64)).points.empty());
  CHECK_THAT(parse_error(with_fields(65)), Contains("FIELDS names no fields"));
}

TEST_CASE("a forged header cannot make us allocate what the file does not hold") {
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  const std::string huge = GENERATE("POINTS 4294967295\n", "WIDTH 65535\nHEIGHT 65535\n");
  CHECK_THAT(parse_error(fields + huge + "DATA binary\n123"), Contains("truncated"));
  CHECK_THAT(parse_error(fields + huge + "DATA ascii\n1 2 3\n"), Contains("truncated"));
  CHECK_THAT(parse_error(fields + "WIDTH 18446744073709551615\nHEIGHT 2\nDATA binary\n"),
             Contains("absurdly large"));
  // 100 million points of 12 bytes announced by a stream of four bytes.
  CHECK_THAT(parse_error(fields + "POINTS 100000000\nDATA binary_compressed\n" +
                         hex("04000000 008c8647 00000000")),
             Contains("too small for the points"));
}

TEST_CASE("more points than four bytes can count are refused before anything is read") {
  const std::string fields = "FIELDS x\nSIZE 4\nTYPE F\n";
  const std::string data =
      GENERATE("DATA ascii\n1\n", "DATA binary\n1234", "DATA binary_compressed\n12345678");
  CHECK_THAT(parse_error(fields + "POINTS 4294967296\n" + data),
             Contains("POINTS is absurdly large"));
  CHECK_THAT(parse_error(fields + "WIDTH 65536\nHEIGHT 65536\n" + data),
             Contains("POINTS is absurdly large"));
}

TEST_CASE("compressed data may grow as much as the coding can, and no more") {
  // 88 bytes of points for each of four compressed bytes: possible, though these are garbage.
  const std::string header = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  const auto error_for = [&](std::uint32_t points) {
    std::string sizes(8, '\0');
    const std::uint32_t compressed = 3;
    const std::uint32_t raw = points * 12;
    std::memcpy(sizes.data(), &compressed, 4);
    std::memcpy(sizes.data() + 4, &raw, 4);
    return parse_error(header + "POINTS " + std::to_string(points) + "\nDATA binary_compressed\n" +
                       sizes + "\xff\xff\xff");
  };
  CHECK_THAT(error_for(22), Contains("damaged"));  // 264 bytes
  CHECK_THAT(error_for(23), Contains("too small for the points"));
}

TEST_CASE("ring and time of each point are read where a field is called so") {
  Scan scan;
  parse_pcd(
      "VERSION 0.7\nFIELDS x y z ring time\nSIZE 4 4 4 2 4\nTYPE F F F U F\n"
      "COUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n1 2 3 7 0\n"
      "4 5 6 8 0.05\n",
      "a.pcd", scan);
  CHECK(scan.ring == std::vector<std::uint16_t>{7, 8});
  REQUIRE(scan.time_s.size() == 2);
  CHECK(scan.time_s[1] == Approx(0.05));
}

TEST_CASE("damaged compression is noticed") {
  std::string bytes = compressed_cloud();
  SECTION("reference to before the beginning") {
    bytes[bytes.size() - 21] = '\x40';
    CHECK_THAT(parse_error(bytes), Contains("compressed data is damaged"));
  }
  SECTION("wrong uncompressed size") {
    bytes[bytes.size() - 25] = 25;
    CHECK_THAT(parse_error(bytes), Contains("does not fit the number of points"));
  }
}

TEST_CASE("a folder of clouds with a trajectory is a recording, poses in TUM or KITTI form") {
  const TemporaryDirectory directory;
  const std::string folder = GENERATE("Scans", "pcd");
  const std::string poses = GENERATE("optimized_poses.txt", "poses.txt");
  directory.write(folder + "/000000.pcd", binary_cloud());
  directory.write(folder + "/000001.pcd", compressed_cloud());

  SECTION("TUM") {
    directory.write(poses, "5.25 0 0 0 0 0 0 1\n5.75 4 0 0 0 0 0 1\n");
    const auto dataset = open_dataset(directory.path());
    REQUIRE(dataset->scan_count() == 2);
    CHECK(dataset->stamp_ns(1) == 5'750'000'000);
    CHECK(dataset->pose(1).translation.x() == 4.0);
    Scan scan;
    dataset->read_scan(1, scan);
    check_two_points(scan);
  }
  SECTION("KITTI") {
    directory.write(poses, std::string(kIdentityLine) + std::string(kOneMetreAheadLine));
    const auto dataset = open_dataset(directory.path());
    CHECK(dataset->stamp_ns(1) == 100'000'000);
    CHECK(dataset->pose(1).translation.x() == 1.0);
  }
  SECTION("too few poses") {
    directory.write(poses, kIdentityLine);
    CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
               Contains(poses) && Contains("1 poses for 2 scans"));
  }
  SECTION("no poses at all") {
    CHECK_THAT(error_of([&] { (void)open_dataset(directory.path(), {.format = "pcd"}); }),
               Contains("no pose file"));
  }
}
