// Tests of the nuScenes reader.
#include "tests/ports/datasets/fixtures.hpp"
#include "tests/test.hpp"

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
class Mini : public TemporaryDirectory {
 public:
  Mini() {
    table("scene", R"([{"token": "t1", "name": "scene-0061"},
                       {"token": "t2", "name": "scene-0103"}])");
    table("sample",
          R"([{"token": "s1", "scene_token": "t1"}, {"token": "s2", "scene_token": "t2"}])");
    table("sample_data",
          "[" + sweep_entry("sweeps/LIDAR_TOP/b.pcd.bin", "1532402927700000", "e2") + "," +
              sweep_entry("samples/LIDAR_TOP/a.pcd.bin", "1532402927650000", "e1") + "," +
              sweep_entry("samples/LIDAR_TOP/c.pcd.bin", "1532402947650000", "e1", "s2") + "," +
              sweep_entry("samples/CAM_FRONT/a.jpg", "1532402927640000", "e9") + "]");
    table("ego_pose", R"([{"token": "e1", "rotation": [1, 0, 0, 0], "translation": [100, 50, 0]},
                          {"token": "e2", "rotation": [1, 0, 0, 0], "translation": [101, 50, 0]}])");
    table("calibrated_sensor", R"([{"token": "c1", "translation": [0.9, 0, 1.8],
                                    "rotation": [0.7071067811865476, 0, 0, -0.7071067811865476]}])");
    write("samples/LIDAR_TOP/a.pcd.bin", kSweep + kSweep);
    write("sweeps/LIDAR_TOP/b.pcd.bin", kSweep);
    write("samples/LIDAR_TOP/c.pcd.bin", kSweep);
  }
  void table(const std::string& name, const std::string& json) const {
    write("v1.0-mini/" + name + ".json", json);
  }
};

}  // namespace

TEST_CASE("a nuScenes scene is its LiDAR's sweeps in order of time, with the LiDAR's poses") {
  const Mini mini;
  const auto dataset = open_dataset(mini.path(), {.sequence = "scene-0061"});
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(0) == "a");
  CHECK(dataset->stamp_ns(1) == 1532402927700000000);
  CHECK(dataset->pose(0).translation.norm() < 1e-9);
  CHECK(dataset->pose(1).translation.isApprox(Eigen::Vector3d(1, 0, 0), 1e-9));
  // The LiDAR looks to the right of the vehicle.
  CHECK((dataset->pose(0).rotation * Eigen::Vector3d::UnitX())
            .isApprox(-Eigen::Vector3d::UnitY(), 1e-9));
  const Scan scan = scan_of(*dataset, 0);
  CHECK(scan.points.size() == 2);
  CHECK(scan.ring == std::vector<std::uint16_t>{3, 3});
}

TEST_CASE("scenes are listed where there are several, and short numbers are understood") {
  const Mini mini;
  CHECK_THAT(open_error(mini.path()), Contains("--sequence") && Contains("scene-0061, scene-0103"));
  CHECK(open_dataset(mini.path(), {.sequence = "0103"})->scan_count() == 1);
}

TEST_CASE("damaged or incomplete nuScenes tables are refused with their file") {
  const auto check = [](const std::string& table, const char* json, const char* reason) {
    const Mini mini;
    mini.table(table, json);
    CHECK_THAT(open_error(mini.path(), {.sequence = "0061"}),
               Contains(table + ".json") && Contains(reason));
  };
  check("ego_pose", "[{\"token\": ", "no JSON array");
  check("calibrated_sensor", R"([{"token": "c1"}])", "translation");
  check("ego_pose", "[]", "lacks the entry e2");
}

TEST_CASE("nuScenes sweeps that are not there are counted") {
  const Mini mini;
  std::filesystem::remove(mini / "sweeps/LIDAR_TOP/b.pcd.bin");
  const auto notes = open_dataset(mini.path(), {.sequence = "0061"})->notes();
  REQUIRE(notes.size() == 2);
  CHECK(notes[1].is_warning);
  CHECK_THAT(notes[1].text, Contains("1 sweeps of scene-0061 are not there"));
}
