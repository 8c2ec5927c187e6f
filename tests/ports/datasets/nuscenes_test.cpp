// Tests of the nuScenes reader.
#include <catch2/catch.hpp>

#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

const std::string kSweep = kPointBytes + hex("00004040");  // ring 3

std::string sweep_entry(const std::string& file, const std::string& stamp, const std::string& ego,
                        const std::string& sample = "s1") {
  return R"({"token": "d)" + stamp + R"(", "sample_token": ")" + sample +
         R"(", "ego_pose_token": ")" + ego +
         R"(", "calibrated_sensor_token": "c1", "timestamp": )" + stamp +
         R"(, "fileformat": "pcd", "filename": ")" + file + R"("})";
}

/// Two sweeps of one scene, one of another, and a picture.
void write_mini(const TemporaryDirectory& directory) {
  const std::string tables = "v1.0-mini/";
  directory.write(tables + "scene.json", R"([{"token": "t1", "name": "scene-0061"},
                                             {"token": "t2", "name": "scene-0103"}])");
  directory.write(tables + "sample.json", R"([{"token": "s1", "scene_token": "t1"},
                                              {"token": "s2", "scene_token": "t2"}])");
  directory.write(tables + "sample_data.json",
                  "[" + sweep_entry("sweeps/LIDAR_TOP/b.pcd.bin", "1532402927700000", "e2") + "," +
                      sweep_entry("samples/LIDAR_TOP/a.pcd.bin", "1532402927650000", "e1") + "," +
                      sweep_entry("samples/LIDAR_TOP/c.pcd.bin", "1532402947650000", "e1", "s2") +
                      "," + sweep_entry("samples/CAM_FRONT/a.jpg", "1532402927640000", "e9") + "]");
  directory.write(tables + "ego_pose.json",
                  R"([{"token": "e1", "rotation": [1, 0, 0, 0], "translation": [100, 50, 0]},
                      {"token": "e2", "rotation": [1, 0, 0, 0], "translation": [101, 50, 0]}])");
  directory.write(tables + "calibrated_sensor.json",
                  R"([{"token": "c1", "translation": [0.9, 0, 1.8],
                       "rotation": [0.7071067811865476, 0, 0, -0.7071067811865476]}])");
  directory.write("samples/LIDAR_TOP/a.pcd.bin", kSweep + kSweep);
  directory.write("sweeps/LIDAR_TOP/b.pcd.bin", kSweep);
  directory.write("samples/LIDAR_TOP/c.pcd.bin", kSweep);
}

}  // namespace

TEST_CASE("a nuScenes scene is its LiDAR's sweeps in order of time, with the LiDAR's poses") {
  const TemporaryDirectory directory;
  write_mini(directory);
  const auto dataset = open_dataset(directory.path(), {.sequence = "scene-0061"});
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(0) == "a");
  CHECK(dataset->stamp_ns(1) == 1532402927700000000);
  CHECK(dataset->pose(0).translation.norm() < 1e-9);
  CHECK(dataset->pose(1).translation.isApprox(Eigen::Vector3d(1, 0, 0), 1e-9));
  // The LiDAR looks to the right of the vehicle.
  CHECK((dataset->pose(0).rotation * Eigen::Vector3d::UnitX())
            .isApprox(-Eigen::Vector3d::UnitY(), 1e-9));
  Scan scan;
  dataset->read_scan(0, scan);
  CHECK(scan.points.size() == 2);
  CHECK(scan.ring == std::vector<std::uint16_t>{3, 3});
}

TEST_CASE("scenes are listed where there are several, and short numbers are understood") {
  const TemporaryDirectory directory;
  write_mini(directory);
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("--sequence") && Contains("scene-0061, scene-0103"));
  CHECK(open_dataset(directory.path(), {.sequence = "0103"})->scan_count() == 1);
}

TEST_CASE("damaged or incomplete nuScenes tables are refused with their file") {
  const TemporaryDirectory directory;
  write_mini(directory);
  const auto error = [&] {
    return error_of([&] { (void)open_dataset(directory.path(), {.sequence = "0061"}); });
  };
  SECTION("no JSON") {
    directory.write("v1.0-mini/ego_pose.json", "[{\"token\": ");
    CHECK_THAT(error(), Contains("ego_pose.json") && Contains("no JSON array"));
  }
  SECTION("no rotation") {
    directory.write("v1.0-mini/calibrated_sensor.json", R"([{"token": "c1"}])");
    CHECK_THAT(error(), Contains("calibrated_sensor.json") && Contains("translation"));
  }
  SECTION("a pose that is missing") {
    directory.write("v1.0-mini/ego_pose.json", "[]");
    CHECK_THAT(error(), Contains("ego_pose.json") && Contains("lacks the entry e2"));
  }
  SECTION("sweeps that are not there") {
    std::filesystem::remove(directory.path() / "sweeps/LIDAR_TOP/b.pcd.bin");
    const auto notes = open_dataset(directory.path(), {.sequence = "0061"})->notes();
    REQUIRE(notes.size() == 2);
    CHECK(notes[1].is_warning);
    CHECK_THAT(notes[1].text, Contains("1 sweeps of scene-0061 are not there"));
  }
}
