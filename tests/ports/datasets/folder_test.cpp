// Tests of folders of scans in any common format, and of record sizes.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "ports/datasets/ply.hpp"
#include "ports/datasets/point_fields.hpp"
#include "ports/datasets/record_width.hpp"
#include "ports/datasets/xyz.hpp"
#include "tests/ports/datasets/pcd_fixtures.hpp"
#include "unimapper/core/voxel_key.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

const std::string kAsciiPly =
    "ply\r\nformat ascii 1.0\r\ncomment any\r\nelement vertex 2\r\nproperty double x\r\n"
    "property float y\r\nproperty float z\r\nproperty uchar intensity\r\nproperty ushort ring\r\n"
    "property uint t\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
    "1 -2 0.5 7 3 0\r\n4 5 6 8 4 50000000\r\n3 0 1 0\r\n";

std::string binary_ply(const std::string& order, const std::string& vertex) {
  return "ply\nformat binary_" + order + "_endian 1.0\nelement vertex 1\nproperty float x\n" +
         "property float y\nproperty float z\nproperty uint8 flags\nproperty float intensity\n" +
         "end_header\n" + vertex;
}

std::string ply_error(const std::string& bytes) {
  Scan scan;
  return error_of([&] { parse_ply(bytes, "a.ply", scan); });
}

std::string xyz_error(const std::string& text) {
  Scan scan;
  return error_of([&] { parse_xyz(text, "a.xyz", scan); });
}

Scan xyz(const std::string& text) {
  Scan scan;
  parse_xyz(text, "a.xyz", scan);
  return scan;
}

/// A sweep of `rings` rings over ground and walls, `width` floats a point: x y z intensity and
/// behind them the ring, and a time.
std::string sweep(std::size_t points, std::size_t width, bool has_intensity = true) {
  std::string bytes;
  for (std::size_t i = 0; i < points; ++i) {
    const std::size_t ring = i % 32;
    const double azimuth = 6.283185307 * static_cast<double>(i / 32) / 100.0;
    const double elevation = -0.5 + 0.02 * static_cast<double>(ring);
    const double range =
        elevation < -0.1 ? -1.7 / std::sin(elevation) : 12.0 + 5.0 * std::sin(3.0 * azimuth);
    const double values[6] = {range * std::cos(elevation) * std::cos(azimuth),
                              range * std::cos(elevation) * std::sin(azimuth),
                              range * std::sin(elevation),
                              has_intensity ? static_cast<double>(mix_bits(i) % 100) : 0.0,
                              static_cast<double>(ring),
                              0.1 * static_cast<double>(i) / static_cast<double>(points)};
    for (std::size_t c = 0; c < width; ++c) {
      const auto value = static_cast<float>(values[c]);
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
  }
  return bytes;
}

/// A KITTI-form recording of `scans` equal scans.
void write_bins(const TemporaryDirectory& directory, const std::string& bytes,
                const std::string& extension = ".bin") {
  directory.write("scans/000000" + extension, bytes);
  directory.write("scans/000001" + extension, bytes);
  directory.write("poses.txt", std::string(kIdentityLine) + std::string(kOneMetreAheadLine));
}

}  // namespace

TEST_CASE("PLY vertices are read in ascii and in both byte orders") {
  Scan scan;
  parse_ply(kAsciiPly, "a.ply", scan);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  CHECK(scan.points[1].intensity == 8.0F);
  CHECK(scan.ring == std::vector<std::uint16_t>{3, 4});
  REQUIRE(scan.time_s.size() == 2);
  CHECK(scan.time_s[1] == Approx(0.05F));

  parse_ply(binary_ply("little", hex("0000803f 000000c0 0000003f ff 0000803e")), "a.ply", scan);
  REQUIRE(scan.points.size() == 1);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  CHECK(scan.points[0].intensity == 0.25F);
  CHECK(scan.ring.empty());
  CHECK(scan.time_s.empty());
  parse_ply(binary_ply("big", hex("3f800000 c0000000 3f000000 ff 3e800000")), "a.ply", scan);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
}

TEST_CASE("elements before the vertices of a PLY are passed over, lists as well") {
  const std::string elements =
      "element camera 2\nproperty float view\nproperty list uchar ushort ids\nelement vertex";
  Scan scan;
  std::string ascii = kAsciiPly;
  ascii.replace(ascii.find("element vertex"), 14, elements);
  ascii.insert(ascii.find("end_header") + 12, "0.5 2 7 8\n0.5 0\n");
  parse_ply("\xef\xbb\xbf" + ascii, "a.ply", scan);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  std::string binary = binary_ply("little", hex("0000803f 02 0700 0800 0000803f 00") +
                                                hex("0000803f 000000c0 0000003f ff 0000803e"));
  binary.replace(binary.find("element vertex"), 14, elements);
  parse_ply(binary, "a.ply", scan);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  const std::size_t count = binary.find("camera 2");
  binary.replace(count, 8, "camera 18446744073709551615");
  CHECK_THAT(ply_error(binary), Contains("truncated"));
}

TEST_CASE("a damaged PLY is refused with offset or line") {
  CHECK_THAT(ply_error("solid\n"), Contains("a.ply:1") && Contains("no PLY file"));
  CHECK_THAT(ply_error("ply\nformat ascii 1.0\n"), Contains("no end"));
  CHECK_THAT(ply_error("ply\nformat text 1.0\n"), Contains("'text'"));
  CHECK_THAT(ply_error("ply\nelement face 1\nend_header\n"), Contains("no element \"vertex\""));
  CHECK_THAT(ply_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n"),
             Contains("no x, y and z"));
  CHECK_THAT(ply_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int x\n"),
             Contains("'list'"));
  CHECK_THAT(ply_error(kAsciiPly.substr(0, kAsciiPly.find("4 5 6"))),
             Contains("promises 2 vertices, 1 are there"));
  CHECK_THAT(ply_error(binary_ply("little", "short")),
             Contains("promises 1 vertices, 0 are there"));
  std::string huge = binary_ply("little", "");
  huge.replace(huge.find("vertex 1"), 8, "vertex 18446744073709551615");
  CHECK_THAT(ply_error(huge), Contains("truncated"));
}

TEST_CASE("text is x y z and intensity, or what a header names") {
  const Scan plain = xyz("1 2 3 0.5\n\n4 5 6 0.25\n");
  REQUIRE(plain.points.size() == 2);
  CHECK(plain.points[1].intensity == 0.25F);
  CHECK(xyz("2\n1 2 3\n4 5 6\n").points.size() == 2);
  CHECK(xyz("1 2 3 255 255 255\n").points[0].intensity == 0.0F);
  const Scan named = xyz("//X,Y,Z,R,Intensity,ring\n1,2,3,9,0.5,4\n");
  CHECK(named.points[0].intensity == 0.5F);
  CHECK(named.ring == std::vector<std::uint16_t>{4});
  CHECK(xyz("intensity;z;y;x\n7;3;2;1\n").view()[0] == Eigen::Vector3f(1, 2, 3));
  CHECK(std::isnan(xyz("nan 2 3\n").points[0].x));
  CHECK(xyz("").points.empty());
  CHECK_THAT(xyz_error("a b c\n"), Contains("a.xyz:1") && Contains("'a' is not a number"));
  CHECK_THAT(xyz_error("1 2\n"), Contains("expected x y z"));
  CHECK_THAT(xyz_error("1 2 3\n1 2 3 4\n"), Contains("a.xyz:2"));
  CHECK_THAT(xyz_error("1 2 3\n1 2 x\n"), Contains("a.xyz:2") && Contains("'x'"));
}

TEST_CASE("a folder of scans of any format, poses in it or beside it, is a recording") {
  const std::string extension = GENERATE(".ply", ".pcd", ".xyz", ".csv", ".bin");
  const std::string folder = GENERATE("", "lidar/");
  INFO(extension << " in " << folder);
  const TemporaryDirectory directory;
  for (const char* name : {"2", "10", "1"}) {
    const std::string bytes = extension == ".ply"   ? kAsciiPly
                              : extension == ".pcd" ? binary_cloud()
                              : extension == ".bin" ? kPointBytes + kPointBytes
                                                    : "1 2 3\n4 5 6\n";
    directory.write(folder + "scan_" + name + extension, bytes);
  }
  directory.write("poses.txt",
                  "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n"
                  "1 0 0 2 0 1 0 0 0 0 1 0\n");
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 3);
  CHECK(dataset->scan_name(2) == "scan_10");
  CHECK(dataset->pose(2).translation.x() == 2.0);
  Scan scan;
  dataset->read_scan(1, scan);
  CHECK(scan.points.size() == 2);
  std::filesystem::remove(directory.path() / "poses.txt");
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("no pose file") && Contains("kiss_icp_pipeline"));
}

TEST_CASE("the number of floats of a record is found from sizes and content") {
  const std::size_t width = GENERATE(std::size_t{4}, std::size_t{5}, std::size_t{6});
  const bool has_intensity = GENERATE(true, false);
  const std::size_t points = GENERATE(std::size_t{3001}, std::size_t{3600});  // 3600: all fit
  INFO(width << " floats, " << points << " points, intensity " << has_intensity);
  const TemporaryDirectory directory;
  write_bins(directory, sweep(points, width, has_intensity));
  const auto dataset = open_dataset(directory.path());
  Scan scan;
  dataset->read_scan(1, scan);
  CHECK(scan.points.size() == points);
  CHECK(scan.ring.size() == (width > 4 ? points : 0));
  if (width > 4) CHECK(scan.ring[33] == 1);
  CHECK(dataset->labels(1).empty());
}

TEST_CASE("nuScenes' records are known by their name") {
  const TemporaryDirectory directory;
  write_bins(directory, kPointBytes + hex("00004040"), ".pcd.bin");
  const auto dataset = open_dataset(directory.path());
  Scan scan;
  dataset->read_scan(0, scan);
  REQUIRE(scan.points.size() == 1);
  CHECK(scan.ring == std::vector<std::uint16_t>{3});
}

TEST_CASE("records that could be of two sizes are refused until --point-fields says") {
  const TemporaryDirectory directory;
  std::string noise;  // every column alike
  for (std::uint64_t i = 0; i < 4 * 3600; ++i) {
    const auto value = static_cast<float>(mix_bits(i) % 1000) - 500.0F;
    noise.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  write_bins(directory, noise);
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("records of 4 or 6 floats?") && Contains("--point-fields"));
  const auto dataset = open_dataset(directory.path(), {.point_fields = "x y z intensity _ _"});
  Scan scan;
  dataset->read_scan(0, scan);
  CHECK(scan.points.size() == 2400);
}

TEST_CASE("what holds no float32 coordinates is refused") {
  const TemporaryDirectory directory;
  std::string doubles;
  for (std::size_t i = 0; i < 4000; ++i) {
    const double value = 20.0 * std::sin(0.37 * static_cast<double>(i)) + 0.123456789;
    doubles.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  write_bins(directory, doubles);
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("no float32 coordinates") && Contains("--point-fields"));
  const auto dataset =
      open_dataset(directory.path(), {.point_fields = "x:f8 y:f8 z:f8 intensity:f8"});
  Scan scan;
  dataset->read_scan(0, scan);
  CHECK(scan.points[0].x == Approx(0.123456789));
}

TEST_CASE("point fields that describe no point are refused with an example") {
  const auto error = [](const std::string& text) {
    return error_of([&] { (void)parse_point_fields(text); });
  };
  CHECK_THAT(error("x y"), Contains("x, y and z are needed"));
  CHECK_THAT(error("x y z:f2"), Contains("'f2' is no type"));
  CHECK_THAT(error("x y z colour"), Contains("'colour'") && Contains("x y z intensity ring"));
  CHECK(parse_point_fields("x,y,z,_:u2,ring:u1").bytes == 15);
}

TEST_CASE("times of points are seconds after the stamp, whatever they count") {
  const auto times = [](const std::string& first, const std::string& last) {
    return xyz("x y z time\n1 2 3 " + first + "\n1 2 3 " + last + "\n").time_s;
  };
  const std::vector<std::string> ends = {"0.1", "100", "100000", "100000000"};
  for (const std::string& end : ends) CHECK(times("0", end)[1] == Approx(0.1));
  CHECK(times("-0.05", "0.05")[0] == Approx(-0.05));
  CHECK(times("1691936557.0", "1691936557.1")[0] == 0.0F);
  CHECK(times("1691936557.0", "1691936557.1")[1] == Approx(0.1));
}

TEST_CASE("compressed scans are refused with what unpacks them") {
  const TemporaryDirectory directory;
  directory.write("velodyne/000000.bin.gz", "x");
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("compressed") && Contains("gunzip"));
}
