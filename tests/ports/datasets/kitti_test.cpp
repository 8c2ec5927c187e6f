// Tests of the readers of KITTI, its raw drives, SemanticKITTI and the simulator's layout.
#include "ports/datasets/kitti_raw.hpp"
#include "ports/datasets/readers.hpp"
#include "ports/datasets/sequence.hpp"
#include "tests/ports/datasets/fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

/// Two scans of two points and one point.
struct KittiSequence : TemporaryDirectory {
  explicit KittiSequence(const std::string& scans = "velodyne") {
    write(scans + "/000000.bin", kPointBytes + kPointBytes);
    write(scans + "/000001.bin", kPointBytes);
    write("poses.txt", kIdentityLine + kOneMetreAheadLine);
  }
  [[nodiscard]] std::string error() const { return open_error(path()); }
};

/// The camera looks along the LiDAR's x axis: x right, y down, z ahead, 0.3 m in front of it.
constexpr std::string_view kCalibration =
    "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.3\n";

const std::string kDrive = "2011_09_26_drive_0005_sync";

/// Three scans, the second of which is missing, on a way to the north at 1 m a scan.
void write_drive(const TemporaryDirectory& directory) {
  const std::string drive = kDrive + "/";
  const double degrees_per_metre = 180.0 / (3.14159265358979 * 6378137.0);
  std::string times;
  for (int i = 0; i < 3; ++i) {
    const std::string name = "000000000" + std::to_string(i);
    if (i != 1) directory.write(drive + "velodyne_points/data/" + name + ".bin", kPointBytes);
    char packet[200];
    std::snprintf(packet, sizeof packet, "49.0 %.12f 116.4 0 0 %.12f 0 0 0\n",
                  8.0 + i * degrees_per_metre / std::cos(49.0 / 57.29577951308232),
                  1.5707963267949);
    directory.write(drive + "oxts/data/" + name + ".txt", packet);
    times += "2011-09-26 13:02:25." + std::to_string(i + 1) + "00000000\n";
  }
  directory.write(drive + "velodyne_points/timestamps.txt", times);
  directory.write(drive + "oxts/timestamps.txt", times);
  directory.write("calib_imu_to_velo.txt",
                  "calib_time: 25-May-2012 16:47:16\nR: 1 0 0 0 1 0 0 0 1\nT: -0.8 0.3 -0.8\n");
}

}  // namespace

TEST_CASE("a KITTI sequence is recognised by its scans, in either folder") {
  const std::string scans = GENERATE("velodyne", "scans");
  const KittiSequence sequence(scans);
  const auto dataset = open_dataset(sequence.path());
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(1) == "000001");
  CHECK(dataset->stamp_ns(0) == 0);
  CHECK(dataset->stamp_ns(1) == 100'000'000);
  CHECK(dataset->pose(1).translation == Eigen::Vector3d(1, 0, 0));
  CHECK(dataset->labels(0).empty());
  CHECK(dataset->ground_truth_poses().empty());
  const Scan scan = scan_of(*dataset, 0);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[1] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
  CHECK(scan.points[1].intensity == 0.25F);
  CHECK(scan_of(*dataset, 1).points.size() == 1);
  // An empty file is a scan without points.
  sequence.write(scans + "/000001.bin", "");
  CHECK(scan_of(*open_dataset(sequence.path()), 1).points.empty());
}

TEST_CASE("times, labels and ground truth are read where they are there") {
  const KittiSequence sequence;
  sequence.write("times.txt", "10.5\n10.6\n");
  sequence.write("labels/000000.label", hex("fb000000 0900 0700"));
  sequence.write("gt_poses.txt", kOneMetreAheadLine + kIdentityLine);
  const auto dataset = open_dataset(sequence.path());
  CHECK(dataset->stamp_ns(1) == 10'600'000'000);
  CHECK(dataset->labels(0) == std::vector<std::uint32_t>{251, 9 + (7U << 16U)});
  CHECK(dataset->labels(1).empty());
  CHECK(dataset->ground_truth_poses().at(0).translation == Eigen::Vector3d(1, 0, 0));
}

TEST_CASE("poses of the camera, true ones as well, become poses of the LiDAR with Tr") {
  const KittiSequence sequence;
  sequence.write("calib.txt", kCalibration);
  sequence.write("poses.txt", kIdentityLine + "1 0 0 0 0 1 0 0 0 0 1 5\n");
  sequence.write("gt_poses.txt", kIdentityLine + "1 0 0 0 0 1 0 0 0 0 1 7\n");
  const auto dataset = open_dataset(sequence.path());
  CHECK(dataset->pose(0).translation.norm() < 1e-12);
  CHECK(dataset->pose(1).translation.isApprox(Eigen::Vector3d(5, 0, 0), 1e-12));
  const auto truth = dataset->ground_truth_poses();
  REQUIRE(truth.size() == 2);
  CHECK(truth[0].translation.norm() < 1e-12);
  CHECK(truth[1].translation.isApprox(Eigen::Vector3d(7, 0, 0), 1e-12));
}

TEST_CASE("poses with stamps are the LiDAR's: KITTI's camera poses have none") {
  const KittiSequence sequence;
  sequence.write("calib.txt", kCalibration);
  sequence.write("times.txt", "10\n10.1\n");
  const auto poses = sequence.write("lidar.tum", "10 0 0 0 0 0 0 1\n10.1 5 0 0 0 0 0 1\n");
  const auto dataset = open_dataset(sequence.path(), {.poses = poses});
  CHECK(dataset->pose(1).translation == Eigen::Vector3d(5, 0, 0));
  CHECK_THAT(dataset->notes().back().text, Contains("the LiDAR's"));
}

TEST_CASE("an excerpt of a sequence takes its poses by scan number") {
  const TemporaryDirectory directory;
  directory.write("velodyne/000001.bin", kPointBytes);
  directory.write("poses.txt", kIdentityLine + kOneMetreAheadLine);
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 1);
  CHECK(dataset->pose(0).translation == Eigen::Vector3d(1, 0, 0));
  CHECK(dataset->stamp_ns(0) == 0);
}

TEST_CASE("a scan of an excerpt may take the last line, not the one behind it") {
  const auto lines_of = [](const std::vector<std::filesystem::path>& files, std::size_t lines) {
    return match_lines(files, lines, "text.txt", "poses");
  };
  CHECK(lines_of({"a/000000.bin", "a/000002.bin"}, 3) == std::vector<std::size_t>{0, 2});
  for (const std::string name : {"000003.bin", "000004.bin", "2x.bin", "-1.bin", ".bin"}) {
    const std::vector<std::filesystem::path> files = {"a/000000.bin", "a/" + name};
    CHECK_THAT(error_of([&] { (void)lines_of(files, 3); }),
               Contains("text.txt") && Contains("3 poses for 2 scans, and the name of " + name +
                                                " does not say which line is its own"));
  }
  // As many lines as scans: their order, whatever the names are.
  CHECK(lines_of({"a/000007.bin", "a/last.bin"}, 2) == std::vector<std::size_t>{0, 1});
}

TEST_CASE("a KITTI raw drive has the poses of its GPS and IMU, by stamp") {
  const TemporaryDirectory directory;
  write_drive(directory);
  const bool by_date = GENERATE(true, false);
  const auto dataset = open_dataset(by_date ? directory.path() : directory / kDrive);
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(1) == "0000000002");
  CHECK(dataset->stamp_ns(1) - dataset->stamp_ns(0) == 200'000'000);
  const Eigen::Vector3d step = dataset->pose(1).translation - dataset->pose(0).translation;
  CHECK(step.isApprox(Eigen::Vector3d(2, 0, 0), 1e-4));
  // The LiDAR is 0.8 m ahead of the IMU, which looks north (y).
  CHECK(dataset->pose(0).translation.isApprox(Eigen::Vector3d(0.3, 0.8, 0.8), 1e-6));
  CHECK(dataset->sensor() == "hdl-64e");
}

TEST_CASE("the drives of a date are listed where there are several") {
  const TemporaryDirectory directory;
  write_drive(directory);
  directory.write("2011_09_26_drive_0001_sync/velodyne_points/data/0000000000.bin", kPointBytes);
  CHECK_THAT(open_error(directory.path()),
             Contains("--sequence") && Contains("drive_0001_sync") && Contains("drive_0005_sync"));
  CHECK(open_dataset(directory.path(), {.sequence = "0005"})->scan_count() == 2);
  CHECK_THAT(open_error(directory.path(), {.sequence = "0001"}), Contains("no oxts/"));
}

TEST_CASE("damaged packets of KITTI raw are refused with their line") {
  check_refusals({{"49.0 8.0\n", {"a.txt:1"}}, {"490 8 1 0 0 0\n", {"latitude"}}, {"", {"empty"}}},
                 [](const std::string& text) { (void)parse_oxts(text, "a.txt"); });
  CHECK_FALSE(parse_raw_calibration("R: 1 0 0 0 1 0 0 0 2\nT: 0 0 0\n", "c.txt"));
  CHECK_FALSE(parse_raw_calibration("T: 0 0 0\n", "c.txt"));
}

TEST_CASE("KITTI odometry, its poses beside the sequences, is read by its root or by a sequence") {
  const TemporaryDirectory directory;
  directory.write("dataset/sequences/00/velodyne/000000.bin", kPointBytes);
  directory.write("dataset/sequences/07/velodyne/000000.bin", kPointBytes);
  directory.write("dataset/poses/00.txt", kIdentityLine);
  directory.write("dataset/poses/07.txt", kOneMetreAheadLine);
  for (const char* sequence : {"dataset/sequences/07", "dataset/sequences/07/"}) {
    CHECK(open_dataset(directory / sequence)->pose(0).translation.x() == 1.0);
  }
  for (const char* root : {"dataset", "."}) {
    const auto dataset = open_dataset(directory / root, {.sequence = "07"});
    CHECK(dataset->pose(0).translation.x() == 1.0);
    CHECK_THAT(open_error(directory / root), Contains("--sequence") && Contains("00, 07"));
  }
}

TEST_CASE("a damaged KITTI sequence is refused with file and reason") {
  const KittiSequence sequence;
  SECTION("truncated scan") {
    sequence.write("velodyne/000001.bin", kPointBytes + "12345");
    CHECK_THAT(sequence.error(),
               Contains("000001.bin") && Contains("offset 16") && Contains("5 of 16 bytes"));
  }
  SECTION("no poses") {
    std::filesystem::remove(sequence / "poses.txt");
    CHECK_THAT(sequence.error(), Contains("own odometry lost 2 of 2 scans"));
  }
  SECTION("fewer poses than scans") {
    sequence.write("poses.txt", kIdentityLine);
    CHECK_THAT(sequence.error(), Contains("1 poses for 2 scans"));
    sequence.write("poses.txt", "");
    CHECK_THAT(sequence.error(), Contains("0 poses for 2 scans"));
  }
  SECTION("fewer times than scans") {
    sequence.write("times.txt", "0.1\n");
    CHECK_THAT(sequence.error(), Contains("1 times for 2 scans"));
  }
  SECTION("no scans") {
    std::filesystem::remove_all(sequence / "velodyne");
    std::filesystem::create_directory(sequence / "velodyne");
    CHECK_THAT(sequence.error(), Contains("not a recording of a known format"));
    CHECK_THAT(open_error(sequence.path(), {.format = "kitti"}), Contains("holds no *.bin"));
  }
  SECTION("fewer labels than points, or more, by one or by part of one") {
    const auto dataset = open_dataset(sequence.path());
    for (const auto& [labels, bytes] :
         {std::pair("09000000", "4"), std::pair("09000000 09000000 09000000", "12"),
          std::pair("09000000 09000000 09", "9")}) {
      sequence.write("labels/000000.label", hex(labels));
      CHECK_THAT(error_of([&] { (void)dataset->labels(0); }),
                 Contains("000000.label") && Contains("2 points") &&
                     Contains("after " + std::string(bytes) + " bytes"));
    }
    sequence.write("labels/000000.label", hex("09000000 09000000"));
    CHECK(dataset->labels(0).size() == 2);
  }
  SECTION("a scan that vanishes while it is needed") {
    const auto dataset = open_dataset(sequence.path());
    std::filesystem::remove(sequence / "velodyne/000001.bin");
    CHECK_THAT(error_of([&] { scan_of(*dataset, 1); }), Contains("no such file"));
  }
  SECTION("damaged ground truth does not prevent reading the scans") {
    sequence.write("gt_poses.txt", "garbage\n");
    const auto dataset = open_dataset(sequence.path());
    CHECK_THAT(error_of([&] { (void)dataset->ground_truth_poses(); }), Contains("gt_poses.txt:1"));
  }
}

TEST_CASE("folders that are no recording are refused") {
  const TemporaryDirectory directory;
  CHECK_THAT(open_error(directory.path()), Contains("not a recording of a known format"));
  CHECK_THAT(open_error(directory / "nowhere"), Contains("no such file or directory"));
  const auto file = directory.write("file.bin", kPointBytes);
  CHECK_THAT(open_error(file), Contains("is one scan; give the folder"));
  for (const auto& [format, missing] :
       {std::pair("kitti", "scans/ or velodyne/"), std::pair("pcd", "pcd/"),
        std::pair("dynamicmap", "pcd/"), std::pair("helipr", "LiDAR/")}) {
    CHECK_THAT(open_error(directory.path(), {.format = format}), Contains(missing));
  }
}

TEST_CASE("every reader has a name of its own and is found by it") {
  for (const Reader& reader : readers()) {
    INFO(reader.name);
    CHECK(find_reader(reader.name) == &reader);
    CHECK_THAT(format_names(), Contains(", " + std::string(reader.name)));
  }
  CHECK(find_reader("KITTI ") == nullptr);
  CHECK_THAT(open_error("/", {.format = "KITTI "}),
             Contains("'KITTI '") && Contains(format_names()));
}
