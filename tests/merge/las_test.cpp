// LAS files of a merged map: bytes, limits, tiles
#include "src/merge/export/las.hpp"

#include <limits>

#include "tests/merge/exported_files.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/export.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Catch::Matchers::Contains;

namespace {

template <typename T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  REQUIRE(at + sizeof value <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

MapPoint point(float x, float y, float z, std::uint32_t session, bool is_ground) {
  return {{x, y, z}, session, 2, is_ground ? 1U : 0U, static_cast<std::uint8_t>(session)};
}

}  // namespace

TEST_CASE("A LAS file has points in whole millimetres and their bounding box", "[las]") {
  const TemporaryDirectory scratch;
  const ExternalVector<MapPoint> points = {point(1.0004F, -2.0F, 3.0F, 0, true),
                                           point(-7.5F, 4.0F, 0.25F, 6, false)};
  constexpr std::int64_t kMarch1_ns = 1'709'251'200'000'000'000;  // 2024
  const LasFrame frame{{700000.0, 5300000.0, 0.0}, "PROJCS[]", kMarch1_ns};
  write_las(scratch / "a.las", points, frame);
  const std::string las = read(scratch / "a.las");
  const std::size_t first = 375 + 54 + 9;
  REQUIRE(las.size() == first + 2 * 30);
  CHECK(las.substr(0, 4) == "LASF");
  CHECK(number_at<std::uint16_t>(las, 90) == 61);  // day of the year
  CHECK(number_at<std::uint16_t>(las, 92) == 2024);
  CHECK(number_at<std::uint32_t>(las, 96) == first);
  CHECK(number_at<std::uint64_t>(las, 247) == 2);
  CHECK(number_at<double>(las, 155 + 8) == 5300000.0);
  CHECK(number_at<double>(las, 179) == 700001.0);  // highest x
  CHECK(number_at<double>(las, 187) == 699992.5);  // lowest x
  CHECK(number_at<double>(las, 211 + 8) == 0.25);  // lowest z
  CHECK(las.substr(375 + 54, 9) == std::string("PROJCS[]\0", 9));
  CHECK(number_at<std::int32_t>(las, first) == 1000);
  CHECK(number_at<std::uint8_t>(las, first + 16) == 2);
  CHECK(number_at<std::uint8_t>(las, first + 17) == 2);
  CHECK(number_at<std::uint16_t>(las, first + 20) == 1);
  CHECK(number_at<std::uint16_t>(las, first + 30 + 12) == 6 * 257);
  CHECK(number_at<std::int32_t>(las, first + 30) == -7500);
  CHECK(number_at<std::uint8_t>(las, first + 30 + 16) == 1);
  CHECK(number_at<std::uint16_t>(las, first + 30 + 20) == 7);
}

TEST_CASE("A LAS file without points is its header", "[las]") {
  const TemporaryDirectory scratch;
  write_las(scratch / "a.las", {}, {});
  const std::string las = read(scratch / "a.las");
  REQUIRE(las.size() == 375);
  CHECK(number_at<std::uint64_t>(las, 247) == 0);
}

TEST_CASE("What a LAS file cannot hold is an error", "[las]") {
  const TemporaryDirectory scratch;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto path = scratch / "a.las";
  CHECK_THROWS_WITH(write_las(path, {point(kNan, 0, 0, 0, false)}, {}), Contains("not finite"));
  CHECK_THROWS_WITH(write_las(path, {point(0, 0, -2.2e6F, 0, false)}, {}), Contains("2147 km"));
  CHECK_THROWS_WITH(write_las(path, {point(0, 0, 0, 65535, false)}, {}), Contains("65535"));
  CHECK_THROWS_WITH(write_las(path, {}, {{0, 0, 0}, std::string(65535, ' '), 0}),
                    Contains("too long"));
  CHECK_THROWS_WITH(write_las("/dev/full", {point(0, 0, 0, 0, false)}, {}), Contains("disk full"));
}

TEST_CASE("Map and tiles are written as LAS in the site frame of its name", "[las]") {
  MergeResult result;
  result.map = {point(1.0F, 1.0F, 0.0F, 0, false), point(5.0F, 1.0F, 0.0F, 0, false)};
  ExportOptions options;
  options.las = true;
  options.tile_m = 4.0;
  options.crs = {"EPSG:25832", "PROJCS[]"};
  const TemporaryDirectory scratch;
  CHECK_THROWS_WITH(export_map(scratch.path(), {}, result, options),
                    "no known position of x and y places the map in EPSG:25832");
  result.georeference = Georeference{{691000.0, 5335000.0, 0.0}, true, 0.1};
  export_map(scratch.path(), {}, result, options);
  CHECK(number_at<std::uint64_t>(read(scratch / "map.las"), 247) == 2);
  const std::string tile = read(scratch / "tiles/1_0.las");
  CHECK(number_at<std::uint64_t>(tile, 247) == 1);
  CHECK(number_at<double>(tile, 179) == 691005.0);
  CHECK_THAT(read(scratch / "summary.json"), Contains("\"crs\": \"EPSG:25832\""));
}
