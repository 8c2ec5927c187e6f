// Tests of the writers: round trips and reported failures.
#include "ports/datasets/writers.hpp"

#include "ports/datasets/poses.hpp"
#include "tests/ports/datasets/fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

/// A pose whose numbers have all their digits.
Pose awkward_pose() {
  return {Eigen::Quaterniond(0.7, -0.1, 0.3, 0.2), Eigen::Vector3d(1.0 / 3.0, -2e-17, 4.1e6)};
}

}  // namespace

TEST_CASE("a written sequence reads back bit by bit") {
  const TemporaryDirectory directory;
  make_directory(directory / "scans");
  make_directory(directory / "labels");
  const std::array<Scan::Point, 2> points = {{{0.1F, -2.0F, 3e-9F, 1.0F}, {4.0F, 5.0F, 6.0F, 0.F}}};
  const std::array<std::uint32_t, 2> labels = {251, 9};
  const std::array<Pose, 1> poses = {awkward_pose()};
  const std::array<std::int64_t, 1> stamps_ns = {1691936557946849179};
  write_kitti_scan(directory / "scans/000000.bin", points);
  write_labels(directory / "labels/000000.label", labels);
  write_kitti_poses(directory / "poses.txt", poses);
  write_times(directory / "times.txt", stamps_ns);

  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 1);
  const Scan scan = scan_of(*dataset, 0);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.points[0].x == 0.1F);
  CHECK(scan.points[0].z == 3e-9F);
  CHECK(dataset->labels(0) == std::vector<std::uint32_t>{251, 9});
  CHECK(dataset->pose(0).rotation == poses[0].rotation);
  CHECK(dataset->pose(0).translation == poses[0].translation);
  CHECK(dataset->stamp_ns(0) == stamps_ns[0]);
}

TEST_CASE("a TUM trajectory reads back, stamps to the nanosecond") {
  const TemporaryDirectory directory;
  const auto file = directory / "trajectory.tum";
  const std::array<Pose, 2> poses = {Pose{}, awkward_pose()};
  const std::array<std::int64_t, 2> stamps_ns = {-1, 1691936557000000042};
  write_tum(file, stamps_ns, poses);
  const std::string text = read_bytes(file);
  CHECK_THAT(text, Contains("-0.000000001 0 0 0 0 0 0 1\n"));
  const auto trajectory = parse_trajectory(text, file);
  CHECK(trajectory.stamps_ns == std::vector<std::int64_t>{-1, 1691936557000000042});
  CHECK(trajectory.poses.at(1).translation == poses[1].translation);
  CHECK(trajectory.poses.at(1).rotation.isApprox(poses[1].rotation, 1e-15));
  CHECK_THROWS_AS(write_tum(file, stamps_ns, std::span(poses).first(1)), DatasetError);
}

TEST_CASE("a PLY file has the header and the bytes it announces") {
  const TemporaryDirectory directory;
  const auto file = directory / "map.ply";
  const std::array<Eigen::Vector3f, 2> positions = {{{1, -2, 0.5F}, {0, 0, 0}}};
  const std::array<Color, 2> colors = {{{255, 0, 16}, {1, 2, 3}}};
  const std::array<std::uint16_t, 2> sessions = {1, 258};
  const std::array<float, 2> shares = {0.25F, 1.0F};
  write_ply(file, {.positions = positions,
                   .colors = colors,
                   .properties = {{"session", std::span<const std::uint16_t>(sessions)},
                                  {"share", std::span<const float>(shares)}}});
  CHECK(read_bytes(file) ==
        "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\n"
        "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\nproperty ushort session\nproperty float share\nend_header\n" +
            hex("0000803f 000000c0 0000003f ff0010 0100 0000803e"
                "00000000 00000000 00000000 010203 0201 0000803f"));
}

TEST_CASE("a PLY file may be empty, but not inconsistent") {
  const TemporaryDirectory directory;
  const auto file = directory / "map.ply";
  write_ply(file, {});
  CHECK_THAT(read_bytes(file), Contains("element vertex 0\n"));
  const std::array<Color, 1> colors = {{{1, 2, 3}}};
  const std::array<float, 1> shares = {1.0F};
  CHECK_THROWS_AS(write_ply(file, {.positions = {}, .colors = colors, .properties = {}}),
                  DatasetError);
  const std::vector<PlyProperty> properties = {{"share", std::span<const float>(shares)}};
  CHECK_THROWS_AS(write_ply(file, {.positions = {}, .colors = {}, .properties = properties}),
                  DatasetError);
}

TEST_CASE("a full disk is reported") {
  if (!std::filesystem::exists("/dev/full")) {
    WARN("skipped: this system has no /dev/full");
    return;
  }
  const std::array<Pose, 1> poses;
  const std::array<std::uint32_t, 1> labels = {9};
  const std::array<std::int64_t, 1> stamps_ns = {0};
  const auto full = [](const auto& write) { CHECK_THAT(error_of(write), Contains("/dev/full")); };
  full([&] { write_labels("/dev/full", labels); });
  full([&] { write_kitti_poses("/dev/full", poses); });
  full([&] { write_times("/dev/full", stamps_ns); });
  full([&] { write_tum("/dev/full", stamps_ns, poses); });
  full([&] { write_kitti_scan("/dev/full", std::vector<Scan::Point>(100000)); });
  full([&] { write_ply("/dev/full", {}); });
  full([&] { write_text("/dev/full", "text"); });
}

TEST_CASE("an unwritable path is reported") {
  const TemporaryDirectory directory;
  const auto file = directory.write("file", "");
  CHECK_THAT(error_of([&] { write_text(directory / "nowhere/file", "text"); }),
             Contains("nowhere/file") && Contains("cannot write"));
  CHECK_THAT(error_of([&] { make_directory(file / "below"); }), Contains("cannot create"));
  CHECK_THAT(error_of([&] { make_directory(file); }), Contains("file"));
}
