// Tests of the association of scans with stamps and poses.
#include "ports/datasets/files.hpp"
#include "ports/datasets/pose_track.hpp"
#include "tests/ports/datasets/pcd_fixtures.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

std::string number(int i) { return std::to_string(i); }

/// A pose in TUM form, along x.
std::string tum_line(const std::string& stamp, double x) {
  return stamp + " " + std::to_string(x) + " 0 0 0 0 0 1\n";
}

/// Poses in KITTI form, one metre after the other along x.
std::string kitti_lines(int count) {
  std::string lines;
  for (int i = 0; i < count; ++i) lines += "1 0 0 " + number(i) + " 0 1 0 0 0 0 1 0\n";
  return lines;
}

/// `count` scans with the names that `name` makes of their number.
struct Clouds : TemporaryDirectory {
  template <typename Name>
  Clouds(int count, const Name& name) {
    for (int i = 0; i < count; ++i) write("pcd/" + std::string(name(i)) + ".pcd", binary_cloud());
  }
  [[nodiscard]] std::unique_ptr<Dataset> open_with(const std::string& poses) const {
    write("poses.txt", poses);
    return open_dataset(path());
  }
  [[nodiscard]] std::string error_with(const std::string& poses) const {
    write("poses.txt", poses);
    return open_error(path());
  }
};

}  // namespace

TEST_CASE("poses in another order, or twice, are those of the same drive") {
  const Clouds scans(4, [](int i) { return "12." + number(i); });
  const auto dataset =
      scans.open_with(tum_line("12.2", 2) + tum_line("12.0", 0) + tum_line("12.0", 0) +
                      tum_line("12.3", 3) + tum_line("12.1", 1));
  REQUIRE(dataset->scan_count() == 4);
  CHECK(dataset->pose(2).translation.x() == 2.0);
  CHECK_THAT(notes_text(*dataset), Contains("1 poses are there twice") &&
                                       Contains("not in the order of their stamps: sorted"));
  CHECK_THAT(scans.error_with(tum_line("12.0", 0) + tum_line("12.0", 1)),
             Contains("two poses 1.000 m apart have this stamp"));
  // A clock that was set back.
  CHECK_THAT(scans.error_with(tum_line("12.0", 0) + tum_line("12.2", 1) + tum_line("12.1", 2) +
                              tum_line("12.3", 3)),
             Contains("was a clock set back"));
}

TEST_CASE("poses that are not finite do not number scans") {
  const Clouds scans(2, [](int i) { return number(i); });
  CHECK_THAT(scans.error_with(tum_line("12.0", 0) + "12.1 nan nan nan nan nan nan nan\n"),
             Contains("1 poses are not finite") && Contains("times.txt"));
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
  const auto check = [](const std::vector<std::filesystem::path>& files,
                        const std::vector<std::int64_t>& expected) {
    CAPTURE(files);
    const auto stamps_ns = stamps_of_names(files);
    REQUIRE(stamps_ns);
    CHECK(*stamps_ns == expected);
  };
  const std::vector<std::int64_t> tenths = {1691936557100000000, 1691936557200000000};
  check({"a/1691936557100000000.bin", "a/1691936557200000000.bin"}, tenths);
  check({"1691936557100000.bin", "1691936557200000.bin"}, tenths);
  check({"1691936557100.pcd", "1691936557200.pcd"}, tenths);
  check({"scan_12.5.pcd", "scan_12.25.pcd"}, {12'500'000'000, 12'250'000'000});
  check({"1691936557_100000000.ply", "1691936557_90000000.ply"},
        {1691936557100000000, 1691936557090000000});
  // A clock that starts with the simulation.
  check({"0.bin", "100000000.bin", "200000000.bin"}, {0, 100'000'000, 200'000'000});
}

TEST_CASE("numbers of scans are no stamps") {
  CHECK_FALSE(stamps_of_names({"000000.bin", "000001.bin"}));
  CHECK_FALSE(stamps_of_names({"0000000000.bin", "0000000153.bin"}));
  CHECK_FALSE(stamps_of_names({"scan_1_000012.bin", "scan_1_000013.bin"}));
  CHECK_FALSE(stamps_of_names({"1691936557100000000.bin", "last.bin"}));
  CHECK_FALSE(stamps_of_names({}));
}

TEST_CASE("scans in seconds with unequal decimals come in order of time") {
  const std::vector<std::string> names = {"1.5", "1.25", "1.125"};
  const Clouds clouds(3, [&](std::size_t i) { return names[i]; });
  const auto dataset = clouds.open_with(kitti_lines(3));
  CHECK(dataset->scan_name(0) == "1.125");
  CHECK(dataset->scan_name(2) == "1.5");
  CHECK(dataset->stamp_ns(1) == 1'250'000'000);
}

TEST_CASE("poses at a higher rate are matched by stamp and interpolated") {
  const Clouds clouds(4, [](int i) { return "17000000" + number(i) + "0.04"; });
  std::string poses;
  for (int i = 0; i <= 200; ++i) {
    char stamp[32];
    std::snprintf(stamp, sizeof stamp, "%.1f", 1700000000.0 + 0.2 * i);
    poses += tum_line(stamp, 0.2 * i);
  }
  const auto dataset = clouds.open_with(poses);
  REQUIRE(dataset->scan_count() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(dataset->pose(i).translation.x() == Approx(10.0 * static_cast<double>(i) + 0.04));
  }
  REQUIRE(dataset->notes().size() == 1);
  CHECK_THAT(dataset->notes()[0].text, Contains("by stamp") && Contains("40 ms"));
  CHECK_FALSE(dataset->notes()[0].is_warning);
}

TEST_CASE("poses of two trajectories in turn are refused, those with a jump and spikes are not") {
  const Clouds clouds(4, [](int i) { return "17000000" + number(i) + "0.04"; });
  const auto poses = [](const auto& aside_m) {
    std::string lines;
    for (int i = 0; i <= 200; ++i) {
      char stamp[32];
      std::snprintf(stamp, sizeof stamp, "%.1f", 1700000000.0 + 0.2 * i);
      lines += tum_line(stamp, 0.2 * i + aside_m(i));
    }
    return lines;
  };
  CHECK_THAT(clouds.error_with(poses([](int i) { return i % 2 == 0 ? 0.0 : 50.0; })),
             Contains("poses.txt") && Contains("alternate between two trajectories: 199 of 200 "
                                               "steps jump and come back"));
  // The second one has a pose for ten of the first.
  CHECK_THAT(clouds.error_with(poses([](int i) { return i % 11 == 5 ? 50.0 : 0.0; })),
             Contains("alternate between two trajectories: 18 of 200"));
  const auto dataset = clouds.open_with(poses(
      [](int i) { return (i > 100 ? 5e5 : 0.0) + (i == 30 || i == 60 || i == 90 ? 50.0 : 0.0); }));
  CHECK(dataset->scan_count() == 4);
}

TEST_CASE("times of the scans and stamps of the poses go together, in seconds or nanoseconds") {
  const bool in_seconds = GENERATE(true, false);
  const auto stamp = [&](int tenths) {
    const std::string digits = number(1700000000 + tenths / 10);
    return digits + (in_seconds ? "." : "") + number(tenths % 10) + (in_seconds ? "" : "00000000");
  };
  const Clouds clouds(2, number);
  clouds.write("times.txt", "1700000000.5\n1700000001\n");
  std::string poses;
  for (const int tenths : {0, 4, 6, 10, 11}) poses += tum_line(stamp(tenths), tenths);
  const auto dataset = clouds.open_with(poses);
  CHECK(dataset->pose(0).translation.x() == Approx(5.0));
  CHECK(dataset->pose(1).translation.x() == 10.0);
}

TEST_CASE("poses at five times the rate of numbered scans are not taken by line") {
  const Clouds clouds(10, number);
  std::string tum;
  std::string times;
  for (int i = 0; i < 50; ++i) {
    tum += tum_line("17." + number(100 + i), i);
    times += number(i) + ".5\n";
  }
  for (const std::string& poses : {tum, kitti_lines(50)}) {
    CHECK_THAT(clouds.error_with(poses), Contains("50 poses for 10 scans numbered 0 to 9") &&
                                             Contains("higher rate") && Contains("times.txt"));
  }
  // Times for every pose say that the lines are those of one sequence.
  clouds.write("times.txt", times);
  CHECK(open_dataset(clouds.path())->pose(9).translation.x() == 9.0);
}

TEST_CASE("scans without a pose near them are left out and counted") {
  const Clouds clouds(10, [](int i) { return "17000000" + number(10 + i) + ".0"; });
  std::string poses;
  for (int i = 0; i <= 160; ++i) {
    if (i > 60 && i < 90) continue;  // nothing for three seconds
    poses += tum_line("17000000" + number(10 + i / 10) + "." + number(i % 10), 0.1 * i);
  }
  for (int i = 170; i <= 175; ++i) poses += tum_line("1700000027." + number(i - 170), i);
  const auto dataset = clouds.open_with(poses);
  CHECK(dataset->scan_count() == 8);
  CHECK(dataset->scan_name(7) == "1700000019.0");
  REQUIRE(dataset->notes().size() == 2);
  CHECK(dataset->notes()[1].is_warning);
  CHECK_THAT(dataset->notes()[1].text, Contains("2 of 10 scans left out") && Contains("2 between"));
}

TEST_CASE("scans and poses of different clocks are refused with both ranges") {
  const Clouds clouds(3, [](int i) { return "170000000" + number(i) + ".0"; });
  CHECK_THAT(clouds.error_with(tum_line("0.0", 0) + tum_line("0.3", 1) + tum_line("0.5", 2)),
             Contains("covers none of the scans") &&
                 Contains("1700000000.000 s to 1700000002.000") && Contains("0.000 s to 0.500 s") &&
                 Contains("one clock"));
}

TEST_CASE("line numbers in the column of stamps are no stamps") {
  const Clouds clouds(4, number);
  const auto dataset =
      clouds.open_with(tum_line("0", 0) + tum_line("1", 1) + tum_line("2", 2) + tum_line("3", 3));
  CHECK(dataset->stamp_ns(3) == 300'000'000);
  CHECK(dataset->pose(3).translation.x() == 3.0);
  CHECK_THAT(dataset->notes().back().text, Contains("10 scans a second"));
}

TEST_CASE("poses with a stamp that contradicts the order of their lines are left out") {
  const auto stamp = [](int i) { return "17000000" + number(10 + i / 10) + "." + number(i % 10); };
  const Clouds clouds(6, [&](int i) { return stamp(10 * i + 5); });
  std::string poses;
  for (int i = 0; i < 60; ++i) poses += tum_line(stamp(i == 27 ? 40 : i), 0.1 * i);
  const auto dataset = clouds.open_with(poses);
  CHECK(dataset->scan_count() == 6);
  CHECK(dataset->pose(2).translation.x() == Approx(2.5));
  CHECK_THAT(dataset->notes().front().text,
             Contains("1 pose of ") && Contains("left out, the first pose 27"));
}

TEST_CASE("a few scans out of order are a warning, many no stamps at all") {
  const Clouds clouds(4, number);
  clouds.write("times.txt", "0\n0.1\n0.05\n0.3\n");
  const auto notes = clouds.open_with(kitti_lines(4))->notes();
  REQUIRE(notes.size() == 1);
  CHECK(notes[0].is_warning);
  CHECK_THAT(notes[0].text, Contains("1 of 4 scans") && Contains("2.pcd"));
  clouds.write("times.txt", "7\n7\n7\n7\n");
  CHECK_THAT(open_error(clouds.path()), Contains("times.txt") && Contains("are these stamps?"));
}
