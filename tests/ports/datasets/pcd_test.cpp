// Tests of PCD files, sequences of them, and DynamicMap_Benchmark's clouds in the world frame.
#include "ports/datasets/pcd.hpp"

#include "tests/ports/datasets/pcd_fixtures.hpp"
#include "tests/test.hpp"

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

const std::string kFields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";

const OpenOptions kDynamicMap{.format = "dynamicmap"};

}  // namespace

TEST_CASE("ascii clouds may hold NaN, further fields and blank lines") {
  const Scan scan = parse(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS ring x y z intensity time\n"
      "SIZE 2 4 4 4 4 4\nTYPE U F F F F F\nCOUNT 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
      "7 1 -2.5 3e0 12 0\r\n\n8 nan nan nan 0 0.05\n");
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.5F, 3.0F));
  CHECK(scan.points[0].intensity == 12.0F);
  CHECK(std::isnan(scan.points[1].x));
  CHECK(scan.ring == std::vector<std::uint16_t>{7, 8});
  REQUIRE(scan.time_s.size() == 2);
  CHECK(scan.time_s[1] == Approx(0.05));
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

TEST_CASE("of fields of several values the first one counts, in every encoding") {
  const std::string one = "0000803f", two = "00000040", three = "00004040", nine = "00001041";
  const auto check = [](const std::string& fields, const std::string& row, const std::string& point,
                        const std::string& columns) {
    const std::string header = fields + "POINTS 2\nDATA ";
    check_two_points(parse(header + "ascii\n" + row + row));
    check_two_points(parse(header + "binary\n" + hex(point + point)));
    check_two_points(parse(header + "binary_compressed\n" + hex(columns)));
  };
  // Literal runs of eight bytes: four values of `normal`, then x, y and z of both points.
  check("FIELDS normal x y z\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 2 1 1 1\n", "9 9 1 2 3\n",
        nine + nine + one + two + three,
        "2d000000 28000000 07" + nine + nine + "07" + nine + nine + "07" + one + one + "07" + two +
            two + "07" + three + three);
  // As drivers do that store x and its error in one field.
  check(kFields + "COUNT 2 1 1\n", "1 9 2 3\n", one + nine + two + three,
        "24000000 20000000 07" + one + nine + "07" + one + nine + "07" + two + two + "07" + three +
            three);
}

TEST_CASE("old headers lack COUNT, VIEWPOINT and POINTS") {
  check_two_points(parse(kFields + "WIDTH 2\nHEIGHT 1\nDATA ascii\n1 2 3\n1 2 3\n"));
}

TEST_CASE("the viewpoint is a position and a quaternion with w first") {
  const PcdHeader header = parse_pcd_header(binary_cloud("10 20 30 0.7071068 0 0 0.7071068"), "a");
  REQUIRE(header.viewpoint);
  CHECK((*header.viewpoint * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(10, 21, 30), 1e-6));
  CHECK_FALSE(parse_pcd_header(binary_cloud("0 0 0 0 0 0 0"), "a").viewpoint);
  CHECK_FALSE(parse_pcd_header(binary_cloud("nan 0 0 1 0 0 0"), "a").viewpoint);
}

TEST_CASE("damaged clouds are refused with file, position and reason") {
  const std::string two = kFields + "WIDTH 2\nHEIGHT 1\n";
  check_refusals({{"", {"cloud.pcd: offset 0", "DATA"}},
                  {"garbage\n", {"cloud.pcd:1", "not a PCD file"}},
                  {std::string(100, '\n'), {"no DATA line"}},
                  {"DATA ascii\n", {"no FIELDS"}},
                  {"SIZE 4\nDATA ascii\n", {"before FIELDS"}},
                  {"FIELDS x y z\nSIZE 4 4\nDATA ascii\n", {"2 values for 3"}},
                  {"FIELDS x\nTYPE Q\nDATA ascii\n", {"TYPE must be"}},
                  {"FIELDS x\nCOUNT 4294967296\nDATA ascii\n", {"COUNT"}},
                  {"FIELDS x\nPOINTS -1\nDATA ascii\n", {"POINTS"}},
                  {"FIELDS x\nDATA ascii\n", {"neither POINTS nor WIDTH"}},
                  {"FIELDS x y\nWIDTH 1\nDATA ascii\n1 2\n", {"x, y and z"}},
                  {two + "DATA ascii\n1 2 3\n4 5 6\n7 8 9\n", {"behind the 2 points announced"}},
                  {two + "DATA binary\n" + std::string(36, '1'),
                   {"12 of 36 bytes", "behind the 2 points announced"}},
                  {two + "DATA smoke\n", {"DATA must be"}},
                  {two + "DATA ascii\n1 2 3\n", {"2 points announced, 1"}},
                  {two + "DATA ascii\n1 2\n", {"cloud.pcd:7"}},
                  {two + "DATA ascii\n1 2 z\n", {"not a number"}},
                  {two + "DATA binary\n12345678901234567890123",
                   {"truncated", "2 points of 12 bytes", "1 are there"}}},
                 parse);
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
  const std::string huge = GENERATE("POINTS 4294967295\n", "WIDTH 65535\nHEIGHT 65535\n");
  CHECK_THAT(parse_error(kFields + huge + "DATA binary\n123"), Contains("truncated"));
  CHECK_THAT(parse_error(kFields + huge + "DATA ascii\n1 2 3\n"), Contains("truncated"));
  CHECK_THAT(parse_error(kFields + "WIDTH 18446744073709551615\nHEIGHT 2\nDATA binary\n"),
             Contains("absurdly large"));
  // 100 million points of 12 bytes announced by a stream of four bytes.
  CHECK_THAT(parse_error(kFields + "POINTS 100000000\nDATA binary_compressed\n" +
                         hex("04000000 008c8647 00000000")),
             Contains("too small for the points"));
}

TEST_CASE("more points than four bytes can count are refused before anything is read") {
  const std::string data =
      GENERATE("DATA ascii\n1\n", "DATA binary\n1234", "DATA binary_compressed\n12345678");
  for (const std::string count : {"POINTS 4294967296\n", "WIDTH 65536\nHEIGHT 65536\n"}) {
    CHECK_THAT(parse_error("FIELDS x\nSIZE 4\nTYPE F\n" + count + data),
               Contains("POINTS is absurdly large"));
  }
}

TEST_CASE("compressed data may grow as much as the coding can, and no more") {
  // 88 bytes of points for each of four compressed bytes: possible, though these are garbage.
  const auto error_for = [](std::uint32_t points) {
    const std::uint32_t sizes[] = {3, points * 12};
    std::string bytes(sizeof sizes, '\0');
    std::memcpy(bytes.data(), sizes, sizeof sizes);
    return parse_error(kFields + "POINTS " + std::to_string(points) + "\nDATA binary_compressed\n" +
                       bytes + "\xff\xff\xff");
  };
  CHECK_THAT(error_for(22), Contains("damaged"));  // 264 bytes
  CHECK_THAT(error_for(23), Contains("too small for the points"));
}

TEST_CASE("damaged compression is noticed") {
  std::string reference = compressed_cloud();
  reference[reference.size() - 21] = '\x40';  // to before the beginning
  CHECK_THAT(parse_error(reference), Contains("compressed data is damaged"));
  std::string size = compressed_cloud();
  size[size.size() - 25] = 25;
  CHECK_THAT(parse_error(size), Contains("does not fit the number of points"));
}

TEST_CASE("a folder of clouds with a trajectory is a recording, poses in TUM or KITTI form") {
  const TemporaryDirectory directory;
  const std::string folder = GENERATE("Scans", "pcd");
  const std::string poses = GENERATE("optimized_poses.txt", "poses.txt");
  directory.write(folder + "/000000.pcd", binary_cloud());
  directory.write(folder + "/000001.pcd", compressed_cloud());

  directory.write(poses, "5.25 0 0 0 0 0 0 1\n5.75 4 0 0 0 0 0 1\n");
  const auto tum = open_dataset(directory.path());
  REQUIRE(tum->scan_count() == 2);
  CHECK(tum->stamp_ns(1) == 5'750'000'000);
  CHECK(tum->pose(1).translation.x() == 4.0);
  check_two_points(scan_of(*tum, 1));

  directory.write(poses, kIdentityLine + kOneMetreAheadLine);
  const auto kitti = open_dataset(directory.path());
  CHECK(kitti->stamp_ns(1) == 100'000'000);
  CHECK(kitti->pose(1).translation.x() == 1.0);

  directory.write(poses, kIdentityLine);
  CHECK_THAT(open_error(directory.path()), Contains(poses) && Contains("1 poses for 2 scans"));
  std::filesystem::remove(directory / poses);
  CHECK_THAT(open_error(directory.path(), {.format = "pcd"}), Contains("own odometry lost"));
}

TEST_CASE("DynamicMap scans come back in the sensor frame, without their ground truth") {
  const TemporaryDirectory directory;
  // The sensor stands at (1, 0, 0) and looks along the world's y axis.
  directory.write("pcd/000010.pcd",
                  binary_cloud("1 0 0 0.7071067811865476 0 0 0.7071067811865476"));
  directory.write("pcd/000011.pcd", binary_cloud());
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(0) == "000010");
  CHECK(dataset->stamp_ns(1) == 100'000'000);
  CHECK(dataset->pose(0).translation == Eigen::Vector3d(1, 0, 0));
  const Scan scan = scan_of(*dataset, 0);
  CHECK(scan.view()[0].isApprox(Eigen::Vector3f(2, 0, 3), 1e-6F));
  CHECK(scan.view()[1].isApprox(Eigen::Vector3f(2, -3, 3), 1e-6F));
  CHECK(scan.points[1].intensity == 0.0F);
  CHECK(dataset->labels(0) == std::vector<std::uint32_t>{9, 251});
}

TEST_CASE("DynamicMap clouds far from their origin keep their points in doubles, or are refused") {
  const TemporaryDirectory directory;
  std::string cloud =
      "VERSION 0.7\nFIELDS x y z intensity\nSIZE 8 8 8 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 1\n"
      "HEIGHT 1\nVIEWPOINT 448262.25 5411904.5 312.125 1 0 0 0\nPOINTS 1\nDATA binary\n";
  const double point[] = {448263.281, 5411902.52, 312.155};
  cloud.append(reinterpret_cast<const char*>(point), sizeof point);
  cloud.append(4, '\0');  // intensity
  directory.write("pcd/000000.pcd", cloud);
  const Scan scan = scan_of(*open_dataset(directory.path(), kDynamicMap), 0);
  CHECK(scan.view()[0].isApprox(Eigen::Vector3f(1.031F, -1.98F, 0.03F), 1e-6F));

  directory.write("pcd/000000.pcd", binary_cloud("448262.25 5411904.5 312.125 1 0 0 0"));
  CHECK_THAT(open_error(directory.path(), kDynamicMap),
             Contains("32-bit floats 5412 km") && Contains("64-bit floats"));
}

TEST_CASE("gt_cloud.pcd tells DynamicMap from other clouds with poses") {
  const TemporaryDirectory directory;
  directory.write("pcd/000000.pcd", binary_cloud("5 0 0 1 0 0 0"));
  directory.write("poses.txt", kIdentityLine);
  CHECK(open_dataset(directory.path())->pose(0).translation.x() == 0.0);
  directory.write("gt_cloud.pcd", binary_cloud());
  CHECK(open_dataset(directory.path())->pose(0).translation.x() == 5.0);
}

TEST_CASE("clouds without poses or viewpoints are not taken for DynamicMap") {
  const TemporaryDirectory directory;
  for (const char* name : {"0", "1", "2"}) {
    directory.write("pcd/" + std::string(name) + ".pcd", binary_cloud());
  }
  CHECK_THAT(open_error(directory.path()), Contains("own odometry lost"));
  CHECK_THAT(open_error(directory.path(), kDynamicMap),
             Contains("every VIEWPOINT is the identity"));
}

TEST_CASE("a viewpoint that is no pose is refused with its file") {
  const TemporaryDirectory directory;
  directory.write("pcd/000000.pcd", binary_cloud());
  directory.write("pcd/000001.pcd", binary_cloud("0 0 nan 1 0 0 0"));
  CHECK_THAT(open_error(directory.path()), Contains("000001.pcd") && Contains("VIEWPOINT"));
}

TEST_CASE("labels that are neither moving nor static are to be ignored") {
  const TemporaryDirectory directory;
  std::string cloud = binary_cloud();
  cloud.replace(cloud.size() - 4, 4, hex("00000040"));
  directory.write("pcd/000000.pcd", cloud);
  CHECK(open_dataset(directory.path(), kDynamicMap)->labels(0) == std::vector<std::uint32_t>{9, 0});
}
