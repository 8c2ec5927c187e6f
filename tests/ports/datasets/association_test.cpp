// Tests of the association of scans with stamps and poses.
#include <algorithm>
#include <catch2/catch.hpp>

#include "ports/datasets/files.hpp"
#include "ports/datasets/pose_track.hpp"
#include "tests/ports/datasets/pcd_fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

namespace fs = std::filesystem;

/// `count` scans with the names that `name` makes of their number.
template <typename Name>
void write_scans(const TemporaryDirectory& directory, int count, const Name& name) {
  for (int i = 0; i < count; ++i) directory.write("pcd/" + name(i) + ".pcd", binary_cloud());
}

std::string number(int i) { return std::to_string(i); }

/// A pose in TUM form, one metre along x a second.
std::string tum_line(const std::string& stamp, double x) {
  return stamp + " " + std::to_string(x) + " 0 0 0 0 0 1\n";
}

std::string kitti_line(int i) { return "1 0 0 " + number(i) + " 0 1 0 0 0 0 1 0\n"; }

std::string open_error(const TemporaryDirectory& directory) {
  return error_of([&] { (void)open_dataset(directory.path()); });
}

std::vector<std::int64_t> stamps_of(const std::vector<fs::path>& files) {
  const auto stamps_ns = stamps_of_names(files);
  REQUIRE(stamps_ns);
  return *stamps_ns;
}

}  // namespace

TEST_CASE("names are in natural order: scan 2 before scan 10") {
  const TemporaryDirectory directory;
  write_scans(directory, 12, number);
  std::string poses;
  for (int i = 0; i < 12; ++i) poses += kitti_line(i);
  directory.write("poses.txt", poses);
  const auto dataset = open_dataset(directory.path());
  for (std::size_t i = 0; i < 12; ++i) {
    CHECK(dataset->scan_name(i) == std::to_string(i));
    CHECK(dataset->pose(i).translation.x() == static_cast<double>(i));
  }
}

TEST_CASE("natural order is an order of all names") {
  const std::vector<std::string> names = {"",     "1",    "01",    "2",     "10",
                                          "a",    "a1",   "a1b",   "a2",    "a10",
                                          "a10b", "b1c2", "b1c10", "b02c1", "scan_9"};
  std::vector<std::string> sorted = names;
  std::reverse(sorted.begin(), sorted.end());
  std::sort(sorted.begin(), sorted.end(), natural_less);
  const auto place = [&](const std::string& name) {
    return std::find(sorted.begin(), sorted.end(), name) - sorted.begin();
  };
  CHECK(place("2") < place("10"));
  CHECK(place("a2") < place("a10"));
  CHECK(place("b1c2") < place("b1c10"));
  CHECK(place("b1c10") < place("b02c1"));
  for (const std::string& a : names) {
    CHECK_FALSE(natural_less(a, a));
    for (const std::string& b : names) CHECK((a == b || natural_less(a, b) != natural_less(b, a)));
  }
}

TEST_CASE("stamps are read from the names of scans, in any unit") {
  CHECK(stamps_of({"a/1691936557100000000.bin", "a/1691936557200000000.bin"}) ==
        std::vector<std::int64_t>{1691936557100000000, 1691936557200000000});
  CHECK(stamps_of({"1691936557100000.bin", "1691936557200000.bin"}) ==
        std::vector<std::int64_t>{1691936557100000000, 1691936557200000000});
  CHECK(stamps_of({"1691936557100.pcd", "1691936557200.pcd"}) ==
        std::vector<std::int64_t>{1691936557100000000, 1691936557200000000});
  CHECK(stamps_of({"scan_12.5.pcd", "scan_12.25.pcd"}) ==
        std::vector<std::int64_t>{12'500'000'000, 12'250'000'000});
  CHECK(stamps_of({"1691936557_100000000.ply", "1691936557_90000000.ply"}) ==
        std::vector<std::int64_t>{1691936557100000000, 1691936557090000000});
  // A clock that starts with the simulation.
  CHECK(stamps_of({"0.bin", "100000000.bin", "200000000.bin"}) ==
        std::vector<std::int64_t>{0, 100'000'000, 200'000'000});
}

TEST_CASE("numbers of scans are no stamps") {
  CHECK_FALSE(stamps_of_names({"000000.bin", "000001.bin"}));
  CHECK_FALSE(stamps_of_names({"0000000000.bin", "0000000153.bin"}));
  CHECK_FALSE(stamps_of_names({"scan_1_000012.bin", "scan_1_000013.bin"}));
  CHECK_FALSE(stamps_of_names({"1691936557100000000.bin", "last.bin"}));
  CHECK_FALSE(stamps_of_names({}));
}

TEST_CASE("scans in seconds with unequal decimals come in order of time") {
  const TemporaryDirectory directory;
  for (const char* name : {"1.5", "1.25", "1.125"}) {
    directory.write("pcd/" + std::string(name) + ".pcd", binary_cloud());
  }
  directory.write("poses.txt", kitti_line(0) + kitti_line(1) + kitti_line(2));
  const auto dataset = open_dataset(directory.path());
  CHECK(dataset->scan_name(0) == "1.125");
  CHECK(dataset->scan_name(2) == "1.5");
  CHECK(dataset->stamp_ns(1) == 1'250'000'000);
}

TEST_CASE("poses at a higher rate are matched by stamp and interpolated") {
  const TemporaryDirectory directory;
  write_scans(directory, 4, [](int i) { return "17000000" + number(i) + "0.04"; });
  std::string poses;
  for (int i = 0; i <= 200; ++i) {
    char stamp[32];
    std::snprintf(stamp, sizeof stamp, "%.1f", 1700000000.0 + 0.2 * i);
    poses += tum_line(stamp, 0.2 * i);
  }
  directory.write("poses.txt", poses);
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 4);
  for (int i = 0; i < 4; ++i) {
    CHECK(dataset->pose(static_cast<std::size_t>(i)).translation.x() == Approx(10.0 * i + 0.04));
  }
  REQUIRE(dataset->notes().size() == 1);
  CHECK_THAT(dataset->notes()[0].text, Contains("by stamp") && Contains("40 ms"));
  CHECK_FALSE(dataset->notes()[0].is_warning);
}

TEST_CASE("times of the scans and stamps of the poses go together, in seconds or nanoseconds") {
  const std::string unit = GENERATE("", "000000000");
  const std::string tenth = unit.empty() ? ".1" : "100000000";
  const TemporaryDirectory directory;
  write_scans(directory, 2, number);
  const std::string first = "1700000000";
  const std::string second = "1700000001";
  directory.write("times.txt", "1700000000.5\n1700000001\n");
  directory.write("poses.txt", tum_line(first + unit, 0.0) +
                                   tum_line(first + (unit.empty() ? ".4" : "400000000"), 4.0) +
                                   tum_line(first + (unit.empty() ? ".6" : "600000000"), 6.0) +
                                   tum_line(second + unit, 10.0) + tum_line(second + tenth, 11.0));
  const auto dataset = open_dataset(directory.path());
  CHECK(dataset->pose(0).translation.x() == Approx(5.0));
  CHECK(dataset->pose(1).translation.x() == 10.0);
}

TEST_CASE("poses at five times the rate of numbered scans are not taken by line") {
  const TemporaryDirectory directory;
  write_scans(directory, 10, number);
  std::string tum;
  std::string kitti;
  for (int i = 0; i < 50; ++i) {
    tum += tum_line("17." + number(100 + i), i);
    kitti += kitti_line(i);
  }
  for (const std::string& poses : {tum, kitti}) {
    directory.write("poses.txt", poses);
    CHECK_THAT(open_error(directory), Contains("50 poses for 10 scans numbered 0 to 9") &&
                                          Contains("higher rate") && Contains("times.txt"));
  }
  // Times for every pose say that the lines are those of one sequence.
  std::string times;
  for (int i = 0; i < 50; ++i) times += number(i) + ".5\n";
  directory.write("times.txt", times);
  CHECK(open_dataset(directory.path())->pose(9).translation.x() == 9.0);
}

TEST_CASE("scans without a pose near them are left out and counted") {
  const TemporaryDirectory directory;
  write_scans(directory, 10, [](int i) { return "17000000" + number(10 + i) + ".0"; });
  std::string poses;
  for (int i = 0; i <= 160; ++i) {
    if (i > 60 && i < 90) continue;  // nothing for three seconds
    poses += tum_line("17000000" + number(10 + i / 10) + "." + number(i % 10), 0.1 * i);
  }
  for (int i = 170; i <= 175; ++i) poses += tum_line("1700000027." + number(i - 170), i);
  directory.write("poses.txt", poses);
  const auto dataset = open_dataset(directory.path());
  CHECK(dataset->scan_count() == 8);
  CHECK(dataset->scan_name(7) == "1700000019.0");
  REQUIRE(dataset->notes().size() == 2);
  CHECK(dataset->notes()[1].is_warning);
  CHECK_THAT(dataset->notes()[1].text, Contains("2 of 10 scans left out") && Contains("2 between"));
}

TEST_CASE("scans and poses of different clocks are refused with both ranges") {
  const TemporaryDirectory directory;
  write_scans(directory, 3, [](int i) { return "170000000" + number(i) + ".0"; });
  directory.write("poses.txt", tum_line("0.0", 0) + tum_line("0.3", 1) + tum_line("0.5", 2));
  CHECK_THAT(open_error(directory), Contains("covers none of the scans") &&
                                        Contains("1700000000.000 s to 1700000002.000") &&
                                        Contains("0.000 s to 0.500 s") && Contains("one clock"));
}

TEST_CASE("line numbers in the column of stamps are no stamps") {
  const TemporaryDirectory directory;
  write_scans(directory, 4, number);
  directory.write("poses.txt",
                  tum_line("0", 0) + tum_line("1", 1) + tum_line("2", 2) + tum_line("3", 3));
  const auto dataset = open_dataset(directory.path());
  CHECK(dataset->stamp_ns(3) == 300'000'000);
  CHECK(dataset->pose(3).translation.x() == 3.0);
  CHECK_THAT(dataset->notes().back().text, Contains("10 scans a second"));
}

TEST_CASE("a few scans out of order are a warning, many no stamps at all") {
  const TemporaryDirectory directory;
  write_scans(directory, 4, number);
  directory.write("poses.txt", kitti_line(0) + kitti_line(1) + kitti_line(2) + kitti_line(3));
  directory.write("times.txt", "0\n0.1\n0.05\n0.3\n");
  const auto notes = open_dataset(directory.path())->notes();
  REQUIRE(notes.size() == 1);
  CHECK(notes[0].is_warning);
  CHECK_THAT(notes[0].text, Contains("1 of 4 scans") && Contains("2.pcd"));
  directory.write("times.txt", "7\n7\n7\n7\n");
  CHECK_THAT(open_error(directory), Contains("times.txt") && Contains("are these stamps?"));
}

TEST_CASE("clouds without poses are refused with what to run, not taken for DynamicMap") {
  const TemporaryDirectory directory;
  write_scans(directory, 3, number);
  CHECK_THAT(open_error(directory),
             Contains("no pose file") && Contains("--poses") && Contains("kiss_icp_pipeline"));
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path(), {.format = "dynamicmap"}); }),
             Contains("every VIEWPOINT is the identity"));
}

TEST_CASE("poses may be anywhere with --poses") {
  const TemporaryDirectory directory;
  write_scans(directory, 1, number);
  const auto poses = directory.write("elsewhere/odometry.tum", tum_line("3", 7));
  CHECK(open_dataset(directory.path(), {.poses = poses})->pose(0).translation.x() == 7.0);
}
