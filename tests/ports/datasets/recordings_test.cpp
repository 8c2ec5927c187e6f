// Tests of the readers on real recordings, if they are there.
#include "tests/recordings.hpp"

#include "ports/datasets/helipr.hpp"
#include "ports/datasets/pcd.hpp"
#include "tests/ports/datasets/fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using unimapper::testing::find_recording;

namespace {

/// Share of finite points whose range lies between the limits.
double share_in_range(const Scan& scan, float min_m, float max_m) {
  const auto inside = std::count_if(scan.points.begin(), scan.points.end(), [&](const auto& p) {
    const float range = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    return range >= min_m && range <= max_m;
  });
  return static_cast<double>(inside) /
         static_cast<double>(std::max<std::size_t>(1, scan.points.size()));
}

}  // namespace

TEST_CASE("real clouds in all three encodings") {
  const auto folder = find_recording("sensors");
  if (folder.empty()) return;
  std::size_t clouds = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".pcd") continue;
    INFO(entry.path().filename());
    Scan scan;
    parse_pcd(read_bytes(entry.path()), entry.path(), scan);
    CHECK(scan.points.size() > 20000);
    CHECK(share_in_range(scan, 0.0F, 200.0F) > 0.9);
    ++clouds;
  }
  CHECK(clouds == 3);
}

TEST_CASE("real Avia and Aeva scans of HeLiPR") {
  const auto folder = find_recording("helipr_samples");
  if (folder.empty()) return;
  for (const auto sensor : {HeliprSensor::kAvia, HeliprSensor::kAeva}) {
    for (const char* name : {"000000.bin", "000001.bin", "000010.bin"}) {
      const auto file = folder / helipr_directory(sensor) / name;
      INFO(file.filename());
      Scan scan;
      parse_helipr(read_bytes(file), sensor, 0, file, scan);
      CHECK(scan.points.size() > 10000);
      // A wrong record length would scatter the coordinates over the whole float range.
      CHECK(share_in_range(scan, 0.0F, 500.0F) > 0.99);
    }
  }
}
