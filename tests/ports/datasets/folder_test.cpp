// Tests of folders of scans in any common format, and of record sizes.
#include "ports/datasets/ply.hpp"
#include "ports/datasets/point_fields.hpp"
#include "ports/datasets/xyz.hpp"
#include "src/core/voxel_key.hpp"
#include "tests/ports/datasets/pcd_fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

const std::string kAsciiPly =
    "ply\r\nformat ascii 1.0\r\ncomment any\r\nelement vertex 2\r\nproperty double x\r\n"
    "property float y\r\nproperty float z\r\nproperty uchar intensity\r\nproperty ushort ring\r\n"
    "property uint t\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
    "1 -2 0.5 7 3 0\r\n4 5 6 8 4 50000000\r\n3 0 1 0\r\n";

std::string binary_ply(const std::string& order, const std::string& vertex,
                       const std::string& count = "1") {
  return "ply\nformat binary_" + order + "_endian 1.0\nelement vertex " + count +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty uint8 flags\n" +
         "property float intensity\nend_header\n" + vertex;
}

Scan ply(const std::string& bytes) {
  Scan scan;
  parse_ply(bytes, "a.ply", scan);
  return scan;
}

Scan xyz(const std::string& text) {
  Scan scan;
  parse_xyz(text, "a.xyz", scan);
  return scan;
}

template <typename T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A sweep of 32 rings over ground and walls, `width` floats a point: x y z intensity and
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
    for (std::size_t c = 0; c < width; ++c) append(bytes, static_cast<float>(values[c]));
  }
  return bytes;
}

/// A KITTI-form recording of two equal scans.
void write_bins(const TemporaryDirectory& directory, const std::string& bytes,
                const std::string& extension = ".bin") {
  directory.write("scans/000000" + extension, bytes);
  directory.write("scans/000001" + extension, bytes);
  directory.write("poses.txt", kIdentityLine + kOneMetreAheadLine);
}

}  // namespace

TEST_CASE("PLY vertices are read in ascii and in both byte orders") {
  const Scan ascii = ply(kAsciiPly);
  REQUIRE(ascii.points.size() == 2);
  CHECK(ascii.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  CHECK(ascii.points[1].intensity == 8.0F);
  CHECK(ascii.ring == std::vector<std::uint16_t>{3, 4});
  REQUIRE(ascii.time_s.size() == 2);
  CHECK(ascii.time_s[1] == Approx(0.05F));
  for (const std::string& bytes :
       {binary_ply("little", hex("0000803f 000000c0 0000003f ff 0000803e")),
        binary_ply("big", hex("3f800000 c0000000 3f000000 ff 3e800000"))}) {
    const Scan scan = ply(bytes);
    REQUIRE(scan.points.size() == 1);
    CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
    CHECK(scan.points[0].intensity == 0.25F);
    CHECK(scan.ring.empty());
    CHECK(scan.time_s.empty());
  }
}

TEST_CASE("elements before the vertices of a PLY are passed over, lists as well") {
  const std::string elements =
      "element camera 2\nproperty float view\nproperty list uchar ushort ids\nelement vertex";
  std::string ascii = kAsciiPly;
  ascii.replace(ascii.find("element vertex"), 14, elements);
  ascii.insert(ascii.find("end_header") + 12, "0.5 2 7 8\n0.5 0\n");
  const Scan scan = ply("\xef\xbb\xbf" + ascii);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  std::string binary = binary_ply("little", hex("0000803f 02 0700 0800 0000803f 00") +
                                                hex("0000803f 000000c0 0000003f ff 0000803e"));
  binary.replace(binary.find("element vertex"), 14, elements);
  CHECK(ply(binary).view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  binary.replace(binary.find("camera 2"), 8, "camera 18446744073709551615");
  CHECK_THAT(error_of([&] { ply(binary); }), Contains("truncated"));
}

TEST_CASE("a damaged PLY is refused with offset or line") {
  const std::string ascii = "ply\nformat ascii 1.0\n";
  check_refusals(
      {{"solid\n", {"a.ply:1", "no PLY file"}},
       {ascii, {"no end"}},
       {"ply\nformat text 1.0\n", {"'text'"}},
       {"ply\nelement face 1\nend_header\n", {"no element \"vertex\""}},
       {ascii + "element vertex 1\nproperty float x\nend_header\n", {"no x, y and z"}},
       {ascii + "element vertex 1\nproperty list uchar int x\n", {"'list'"}},
       {kAsciiPly.substr(0, kAsciiPly.find("4 5 6")), {"promises 2 vertices, 1 are there"}},
       {binary_ply("little", "short"), {"promises 1 vertices, 0 are there"}},
       {binary_ply("little", "", "18446744073709551615"), {"truncated"}}},
      ply);
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
  // Times are seconds after the stamp, whatever they count.
  for (const std::string end : {"0.1", "100", "100000", "100000000"}) {
    CHECK(xyz("x y z time\n1 2 3 0\n1 2 3 " + end + "\n").time_s.at(1) == Approx(0.1));
  }
  CHECK(xyz("x y z time\n1 2 3 -0.05\n1 2 3 0.05\n").time_s.at(0) == Approx(-0.05));
  // Stamps of the points: the scan begins with the first one.
  const auto times_s = xyz("x y z time\n1 2 3 1691936557.1\n1 2 3 1691936557.0\n").time_s;
  CHECK(times_s.at(0) == Approx(0.1));
  CHECK(times_s.at(1) == 0.0F);
  check_refusals({{"a b c\n", {"a.xyz:1", "'a' is not a number"}},
                  {"1 2\n", {"expected x y z"}},
                  {"1 2 3\n1 2 3 4\n", {"a.xyz:2"}},
                  {"1 2 3\n1 2 x\n", {"a.xyz:2", "'x'"}}},
                 xyz);
}

TEST_CASE("a folder of scans of any format, poses in it or beside it, is a recording") {
  const std::string extension = GENERATE(".ply", ".pcd", ".xyz", ".csv", ".bin");
  const std::string folder = GENERATE("", "lidar/");
  INFO(extension << " in " << folder);
  const TemporaryDirectory directory;
  const std::string bytes = extension == ".ply"   ? kAsciiPly
                            : extension == ".pcd" ? binary_cloud()
                            : extension == ".bin" ? kPointBytes + kPointBytes
                                                  : "1 2 3\n4 5 6\n";
  // In natural order: scan 2 before scan 10.
  for (const char* name : {"2", "10", "1"}) {
    directory.write(folder + "scan_" + name + extension, bytes);
  }
  directory.write("poses.txt", kIdentityLine + kOneMetreAheadLine + "1 0 0 2 0 1 0 0 0 0 1 0\n");
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 3);
  const std::vector<std::string> names = {"scan_1", "scan_2", "scan_10"};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(dataset->scan_name(i) == names[i]);
    CHECK(dataset->pose(i).translation.x() == static_cast<double>(i));
  }
  CHECK(scan_of(*dataset, 1).points.size() == 2);
  std::filesystem::remove(directory / "poses.txt");
  CHECK_THAT(open_error(directory.path()),
             Contains("own odometry lost 3 of 3 scans") && Contains("--poses"));
}

TEST_CASE("the number of floats of a record is found from sizes and content") {
  const std::size_t width = GENERATE(std::size_t{4}, std::size_t{5}, std::size_t{6});
  const bool has_intensity = GENERATE(true, false);
  const std::size_t points = GENERATE(std::size_t{3001}, std::size_t{3600});  // 3600: all fit
  INFO(width << " floats, " << points << " points, intensity " << has_intensity);
  const TemporaryDirectory directory;
  write_bins(directory, sweep(points, width, has_intensity));
  const auto dataset = open_dataset(directory.path());
  const Scan scan = scan_of(*dataset, 1);
  CHECK(scan.points.size() == points);
  CHECK(scan.ring.size() == (width > 4 ? points : 0));
  if (width > 4) CHECK(scan.ring[33] == 1);
  CHECK(dataset->labels(1).empty());
}

TEST_CASE("nuScenes' records are known by their name") {
  const TemporaryDirectory directory;
  write_bins(directory, kPointBytes + hex("00004040"), ".pcd.bin");
  const Scan scan = scan_of(*open_dataset(directory.path()), 0);
  REQUIRE(scan.points.size() == 1);
  CHECK(scan.ring == std::vector<std::uint16_t>{3});
}

TEST_CASE("records that could be of two sizes are refused until --point-fields says") {
  const TemporaryDirectory directory;
  std::string noise;  // every column alike
  for (std::uint64_t i = 0; i < 4 * 3600; ++i) {
    append(noise, static_cast<float>(mix_bits(i) % 1000) - 500.0F);
  }
  write_bins(directory, noise);
  CHECK_THAT(open_error(directory.path()),
             Contains("records of 4 or 6 floats?") && Contains("--point-fields"));
  const auto dataset = open_dataset(directory.path(), {.point_fields = "x y z intensity _ _"});
  CHECK(scan_of(*dataset, 0).points.size() == 2400);
}

TEST_CASE("what holds no float32 coordinates is refused") {
  const TemporaryDirectory directory;
  std::string doubles;
  for (std::size_t i = 0; i < 4000; ++i) {
    append(doubles, 20.0 * std::sin(0.37 * static_cast<double>(i)) + 0.123456789);
  }
  write_bins(directory, doubles);
  CHECK_THAT(open_error(directory.path()),
             Contains("no float32 coordinates") && Contains("--point-fields"));
  const auto dataset =
      open_dataset(directory.path(), {.point_fields = "x:f8 y:f8 z:f8 intensity:f8"});
  CHECK(scan_of(*dataset, 0).points[0].x == Approx(0.123456789));
}

TEST_CASE("point fields that describe no point are refused with an example") {
  check_refusals({{"x y", {"x, y and z are needed"}},
                  {"x y z:f2", {"'f2' is no type"}},
                  {"x y z colour", {"'colour'", "x y z intensity ring"}}},
                 parse_point_fields);
  CHECK(parse_point_fields("x,y,z,_:u2,ring:u1").bytes == 15);
}

TEST_CASE("compressed scans are refused with what unpacks them") {
  const TemporaryDirectory directory;
  directory.write("velodyne/000000.bin.gz", "x");
  CHECK_THAT(open_error(directory.path()), Contains("compressed") && Contains("gunzip"));
}
