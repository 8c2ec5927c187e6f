// Tests of damaged files: reading ends in points or in a DatasetError.
#include "ports/datasets/helipr.hpp"
#include "ports/datasets/kitti_raw.hpp"
#include "ports/datasets/nuscenes.hpp"
#include "ports/datasets/pcd.hpp"
#include "ports/datasets/ply.hpp"
#include "ports/datasets/point_fields.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/datasets/xyz.hpp"
#include "src/core/voxel_key.hpp"
#include "tests/ports/datasets/pcd_fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;

namespace {

const std::string kAsciiCloud =
    "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\n"
    "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3 4\n5 6 7 8\n";

const std::string kTrajectories =
    "# comment\n0.5 1 2 3 0 0 0.6 0.8\n1.5e0 1 2 3 0 0 -0.6 0.8\n1e300 1 2 3 0 0 0 1\n";

const std::string kAsciiPly =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    "property float z\nproperty uint t\nend_header\n1 2 3 4\n";

/// Every table at once.
const std::string kNuScenesTable =
    R"([{"token": "a", "name": "s", "scene_token": "a", "sample_token": "a", "timestamp": 5,
         "ego_pose_token": "a", "calibrated_sensor_token": "a", "filename": "LIDAR_TOP",
         "translation": [1, 2, 3], "rotation": [1, 0, 0, 0]}])";

/// Everything that parses, on the same bytes. Only DatasetError may come out.
void parse_everything(const std::string& bytes) {
  const auto attempt = [](const auto& parse) {
    try {
      parse();
    } catch (const DatasetError&) {
    }
  };
  Scan scan;
  attempt([&] { (void)parse_pcd(bytes, "file", scan); });
  attempt([&] { (void)parse_pcd_header(bytes, "file"); });
  attempt([&] { (void)parse_trajectory(bytes, "file"); });
  attempt([&] { (void)parse_trajectory(bytes, "file", StampUnit::kNanoseconds); });
  attempt([&] { (void)parse_times(bytes, "file"); });
  attempt([&] { parse_ply(bytes, "file", scan); });
  attempt([&] { parse_xyz(bytes, "file", scan); });
  attempt([&] { (void)parse_oxts(bytes, "file"); });
  attempt([&] { (void)parse_raw_calibration(bytes, "file"); });
  attempt([&] { (void)parse_point_fields(bytes); });
  attempt([&] {
    const NuScenesTable table = [&](std::string_view) { return bytes; };
    for (const std::string& scene : parse_nuscenes_scenes(table, "tables")) {
      (void)parse_nuscenes_sweeps(table, scene, "tables");
    }
  });
  attempt([&] { (void)parse_calibration(bytes, "file"); });
  for (const auto sensor :
       {HeliprSensor::kAeva, HeliprSensor::kAvia, HeliprSensor::kOuster, HeliprSensor::kVelodyne}) {
    attempt([&] { parse_helipr(bytes, sensor, 0, "file", scan); });
  }
}

const std::vector<std::string> kFiles = {
    kAsciiCloud, binary_cloud(), compressed_cloud(), kTrajectories,
    kAsciiPly,   kNuScenesTable, kPointBytes,        "Tr: " + kIdentityLine + kOneMetreAheadLine};

}  // namespace

TEST_CASE("a file cut off at any byte is read or refused") {
  for (const std::string& bytes : kFiles) {
    for (std::size_t length = 0; length <= bytes.size(); ++length) {
      parse_everything(bytes.substr(0, length));
    }
  }
}

TEST_CASE("a cloud cut off within its points is refused") {
  for (const std::string& bytes : {binary_cloud(), compressed_cloud(), kAsciiCloud}) {
    // The last byte of the ascii cloud is the line break, which nothing needs.
    const std::size_t needed = bytes.back() == '\n' ? bytes.size() - 1 : bytes.size();
    Scan scan;
    REQUIRE_NOTHROW(parse_pcd(bytes, "file", scan));
    for (std::size_t length = 0; length < needed; ++length) {
      CHECK_THROWS_AS(parse_pcd(std::string_view(bytes).substr(0, length), "file", scan),
                      DatasetError);
    }
  }
}

TEST_CASE("a file with any one byte changed is read or refused") {
  for (const std::string& bytes : kFiles) {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      for (const char value : {'\0', '\n', ' ', '9', '-', '\x40', '\x7f', '\xff'}) {
        std::string changed = bytes;
        changed[i] = value;
        parse_everything(changed);
      }
    }
  }
}

TEST_CASE("files of arbitrary bytes are read or refused") {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    std::string bytes = seed % 2 == 0 ? compressed_cloud().substr(0, 160) : std::string();
    const auto length = static_cast<std::size_t>(mix_bits(seed) % 500);
    for (std::size_t i = 0; i < length; ++i) {
      bytes += static_cast<char>(mix_bits(seed * 1000 + i));
    }
    parse_everything(bytes);
  }
}
