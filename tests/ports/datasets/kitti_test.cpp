// Tests of the readers of KITTI, SemanticKITTI and the simulator's layout.
#include <catch2/catch.hpp>

#include "ports/datasets/readers.hpp"
#include "ports/datasets/sequence.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

std::string open_error(const std::filesystem::path& path, const std::string& format = "auto") {
  return error_of([&] { (void)open_dataset(path, {.format = format}); });
}

/// Two scans of two points and one point.
void write_sequence(const TemporaryDirectory& directory, const std::string& scans = "velodyne") {
  directory.write(scans + "/000000.bin", kPointBytes + kPointBytes);
  directory.write(scans + "/000001.bin", kPointBytes);
  directory.write("poses.txt", std::string(kIdentityLine) + std::string(kOneMetreAheadLine));
}

}  // namespace

TEST_CASE("a KITTI sequence is recognised by its scans, in either folder") {
  const std::string scans = GENERATE("velodyne", "scans");
  const TemporaryDirectory directory;
  write_sequence(directory, scans);
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(1) == "000001");
  CHECK(dataset->stamp_ns(0) == 0);
  CHECK(dataset->stamp_ns(1) == 100'000'000);
  CHECK(dataset->pose(1).translation == Eigen::Vector3d(1, 0, 0));
  CHECK(dataset->labels(0).empty());
  CHECK(dataset->ground_truth_poses().empty());
  Scan scan;
  dataset->read_scan(0, scan);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[1] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  CHECK(scan.points[1].intensity == 0.25F);
  dataset->read_scan(1, scan);
  CHECK(scan.points.size() == 1);
}

TEST_CASE("times, labels and ground truth are read where they are there") {
  const TemporaryDirectory directory;
  write_sequence(directory);
  directory.write("times.txt", "10.5\n10.6\n");
  directory.write("labels/000000.label", hex("fb000000 0900 0700"));
  directory.write("gt_poses.txt", std::string(kOneMetreAheadLine) + std::string(kIdentityLine));
  const auto dataset = open_dataset(directory.path());
  CHECK(dataset->stamp_ns(1) == 10'600'000'000);
  CHECK(dataset->labels(0) == std::vector<std::uint32_t>{251, 9 + (7U << 16U)});
  CHECK(dataset->labels(1).empty());
  CHECK(dataset->ground_truth_poses().at(0).translation == Eigen::Vector3d(1, 0, 0));
}

TEST_CASE("poses of the camera become poses of the LiDAR with Tr") {
  const TemporaryDirectory directory;
  write_sequence(directory);
  // The camera looks along the LiDAR's x axis: x right, y down, z ahead, 0.3 m in front of it.
  directory.write("calib.txt",
                  "P0: 1 0 0 0 0 1 0 0 0 0 1 0\n"
                  "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.3\n");
  directory.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 5\n");
  const auto dataset = open_dataset(directory.path());
  CHECK(dataset->pose(0).translation.norm() < 1e-12);
  CHECK(dataset->pose(1).translation.isApprox(Eigen::Vector3d(5, 0, 0), 1e-12));
}

TEST_CASE("poses with stamps are the LiDAR's: KITTI's camera poses have none") {
  const TemporaryDirectory directory;
  write_sequence(directory);
  directory.write("calib.txt", "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.3\n");
  directory.write("times.txt", "10\n10.1\n");
  const auto poses = directory.write("lidar.tum", "10 0 0 0 0 0 0 1\n10.1 5 0 0 0 0 0 1\n");
  const auto dataset = open_dataset(directory.path(), {.poses = poses});
  CHECK(dataset->pose(1).translation == Eigen::Vector3d(5, 0, 0));
  CHECK_THAT(dataset->notes().back().text, Contains("the LiDAR's"));
}

TEST_CASE("true poses of the camera become poses of the LiDAR with Tr, too") {
  const TemporaryDirectory directory;
  write_sequence(directory);
  directory.write("calib.txt", "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.3\n");
  directory.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 5\n");
  directory.write("gt_poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 7\n");
  const auto truth = open_dataset(directory.path())->ground_truth_poses();
  REQUIRE(truth.size() == 2);
  CHECK(truth[0].translation.norm() < 1e-12);
  CHECK(truth[1].translation.isApprox(Eigen::Vector3d(7, 0, 0), 1e-12));
}

TEST_CASE("an excerpt of a sequence takes its poses by scan number") {
  const TemporaryDirectory directory;
  directory.write("velodyne/000001.bin", kPointBytes);
  directory.write("poses.txt", std::string(kIdentityLine) + std::string(kOneMetreAheadLine));
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 1);
  CHECK(dataset->pose(0).translation == Eigen::Vector3d(1, 0, 0));
  CHECK(dataset->stamp_ns(0) == 0);
}

TEST_CASE("a scan of an excerpt may take the last line, not the one behind it") {
  const std::string name = "text.txt";
  const auto lines_of = [&](const std::vector<std::filesystem::path>& files, std::size_t lines) {
    return match_lines(files, lines, name, "poses");
  };
  CHECK(lines_of({"a/000000.bin", "a/000002.bin"}, 3) == std::vector<std::size_t>{0, 2});
  for (const char* file : {"a/000003.bin", "a/000004.bin", "a/2x.bin", "a/-1.bin", "a/.bin"}) {
    INFO(file);
    const std::string stem = std::filesystem::path(file).filename().string();
    CHECK_THAT(error_of([&] {
                 (void)lines_of({"a/000000.bin", file}, 3);
               }),
               Contains(name) && Contains("3 poses for 2 scans, and the name of " + stem +
                                          " does not say which line is its own"));
  }
  // As many lines as scans: their order, whatever the names are.
  CHECK(lines_of({"a/000007.bin", "a/last.bin"}, 2) == std::vector<std::size_t>{0, 1});
  CHECK_THAT(error_of([&] {
               (void)lines_of({"a/000000.bin", "a/000001.bin"}, 1);
             }),
             Contains("1 poses for 2 scans"));
}

TEST_CASE("KITTI odometry keeps its poses in a folder beside the sequences") {
  const TemporaryDirectory directory;
  directory.write("sequences/07/velodyne/000000.bin", kPointBytes);
  directory.write("poses/07.txt", kOneMetreAheadLine);
  CHECK(open_dataset(directory.path() / "sequences/07")->pose(0).translation.x() == 1.0);
  CHECK(open_dataset(directory.path() / "sequences/07/")->pose(0).translation.x() == 1.0);
}

TEST_CASE("an empty scan is a scan without points") {
  const TemporaryDirectory directory;
  write_sequence(directory);
  directory.write("velodyne/000001.bin", "");
  Scan scan;
  open_dataset(directory.path())->read_scan(1, scan);
  CHECK(scan.points.empty());
}

TEST_CASE("a damaged KITTI sequence is refused with file and reason") {
  const TemporaryDirectory directory;
  write_sequence(directory);

  SECTION("truncated scan") {
    directory.write("velodyne/000001.bin", kPointBytes + "12345");
    CHECK_THAT(open_error(directory.path()),
               Contains("000001.bin") && Contains("offset 16") && Contains("5 of 16 bytes"));
  }
  SECTION("no poses") {
    std::filesystem::remove(directory.path() / "poses.txt");
    CHECK_THAT(open_error(directory.path()), Contains("poses.txt") && Contains("no such file"));
  }
  SECTION("fewer poses than scans") {
    directory.write("poses.txt", kIdentityLine);
    CHECK_THAT(open_error(directory.path()), Contains("1 poses for 2 scans"));
  }
  SECTION("more poses than scans, and names that are no numbers") {
    directory.write("velodyne/last.bin", kPointBytes);
    directory.write("poses.txt", std::string(kIdentityLine) + std::string(kIdentityLine) +
                                     std::string(kIdentityLine) + std::string(kIdentityLine));
    CHECK_THAT(open_error(directory.path()), Contains("last.bin"));
  }
  SECTION("fewer times than scans") {
    directory.write("times.txt", "0.1\n");
    CHECK_THAT(open_error(directory.path()), Contains("1 times for 2 scans"));
  }
  SECTION("empty pose file") {
    directory.write("poses.txt", "");
    CHECK_THAT(open_error(directory.path()), Contains("0 poses for 2 scans"));
  }
  SECTION("no scans") {
    std::filesystem::remove_all(directory.path() / "velodyne");
    std::filesystem::create_directory(directory.path() / "velodyne");
    CHECK_THAT(open_error(directory.path()), Contains("not a recording of a known format"));
    CHECK_THAT(open_error(directory.path(), "kitti"), Contains("holds no *.bin"));
  }
  SECTION("labels of another length") {
    directory.write("labels/000000.label", hex("09000000"));
    const auto dataset = open_dataset(directory.path());
    CHECK_THAT(error_of([&] { (void)dataset->labels(0); }),
               Contains("000000.label") && Contains("2 points"));
  }
  SECTION("more labels than points, by one or by part of one") {
    const auto dataset = open_dataset(directory.path());
    directory.write("labels/000000.label", hex("09000000 09000000 09000000"));
    CHECK_THAT(error_of([&] { (void)dataset->labels(0); }),
               Contains("000000.label") && Contains("after 12 bytes") && Contains("2 points"));
    directory.write("labels/000000.label", hex("09000000 09000000 09"));
    CHECK_THAT(error_of([&] { (void)dataset->labels(0); }), Contains("after 9 bytes"));
    directory.write("labels/000000.label", hex("09000000 09000000"));
    CHECK(dataset->labels(0).size() == 2);
  }
  SECTION("a scan that vanishes while it is needed") {
    const auto dataset = open_dataset(directory.path());
    std::filesystem::remove(directory.path() / "velodyne/000001.bin");
    Scan scan;
    CHECK_THAT(error_of([&] { dataset->read_scan(1, scan); }), Contains("no such file"));
  }
  SECTION("damaged ground truth does not prevent reading the scans") {
    directory.write("gt_poses.txt", "garbage\n");
    const auto dataset = open_dataset(directory.path());
    CHECK_THAT(error_of([&] { (void)dataset->ground_truth_poses(); }), Contains("gt_poses.txt:1"));
  }
}

TEST_CASE("folders that are no recording are refused") {
  const TemporaryDirectory directory;
  CHECK_THAT(open_error(directory.path()), Contains("not a recording of a known format"));
  CHECK_THAT(open_error(directory.path() / "nowhere"), Contains("no such file or directory"));
  const auto file = directory.write("file.bin", kPointBytes);
  CHECK_THAT(open_error(file), Contains("is one scan; give the folder"));
  CHECK_THAT(open_error(directory.path(), "kitti"), Contains("scans/ or velodyne/"));
  CHECK_THAT(open_error(directory.path(), "pcd"), Contains("pcd/"));
  CHECK_THAT(open_error(directory.path(), "dynamicmap"), Contains("pcd/"));
  CHECK_THAT(open_error(directory.path(), "helipr"), Contains("LiDAR/"));
}

TEST_CASE("every reader has a name of its own and is found by it") {
  for (const Reader& reader : readers()) {
    INFO(reader.name);
    CHECK(find_reader(reader.name) == &reader);
    CHECK_THAT(format_names(), Contains(", " + std::string(reader.name)));
  }
  CHECK(find_reader("KITTI ") == nullptr);
  CHECK_THAT(open_error("/", "KITTI "), Contains("'KITTI '") && Contains(format_names()));
}
