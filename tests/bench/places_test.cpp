// Tests of the place recognition benchmark: scores of a pair of drives, means of rows, STD's file.
#include "bench/places/pair_row.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::bench;

namespace {

Pose at(double x, double y) { return {Eigen::Matrix3d::Identity(), {x, y, 0.0}}; }

/// Keyframes 10 m apart on the x axis.
Drive drive_along(std::size_t keyframes) {
  Drive drive;
  drive.sensor = "vlp-16";
  drive.route = "B";
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    PlaceKeyframe& keyframe = drive.keyframes.emplace_back();
    keyframe.sequence = 100 + i;
    keyframe.T_world_keyframe = at(10.0 * i, 0.0);
    keyframe.describe_ms = 1.0 + i;
  }
  return drive;
}

LoopRecord loop(std::uint32_t query, std::uint32_t match, double confidence, bool accepted,
                const Pose& T_match_query) {
  LoopRecord record;
  record.query_keyframe = 100 + query;
  record.match_keyframe = 100 + match;
  record.confidence = confidence;
  record.accepted = accepted;
  record.T_match_query = T_match_query;
  return record;
}

PairRow row_of(const char* route, std::size_t positives, double f1, std::size_t right) {
  PairRow row;
  row.database = row.queries = "vlp-16";
  row.group = group_of(row.database, row.queries);
  row.route = route;
  row.positives = positives;
  row.by_pose.f1_max = f1;
  row.by_pose.operating_point.true_positives = right;
  row.error_m = std::nan("");
  return row;
}

}  // namespace

TEST_CASE("STD's descriptions come back from their file bit by bit") {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "std.places";
  StdPlace described;
  described.keypoints.push_back({{1.0 / 3.0, -2.0, 1e-9}, {0.0, 0.1, 1.0}, 12.0});
  described.planes.push_back({{5.0, 6e5, 7.0 / 11.0}, {0.0, 1.0, 0.0}});
  write_std_file(file, {described, {}});
  const auto read = read_std_file(file);
  REQUIRE(read.size() == 2);
  REQUIRE(read[0].keypoints.size() == 1);
  CHECK(read[0].keypoints[0].position == described.keypoints[0].position);
  CHECK(read[0].keypoints[0].normal == described.keypoints[0].normal);
  CHECK(read[0].keypoints[0].count == 12.0);
  REQUIRE(read[0].planes.size() == 1);
  CHECK(read[0].planes[0].center == described.planes[0].center);
  CHECK(read[0].planes[0].normal == described.planes[0].normal);
  CHECK(read[1].keypoints.empty());
}

TEST_CASE("a torn or foreign file of STD's descriptions is refused") {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "std.places";
  write_std_file(file, std::vector<StdPlace>(3));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 1);
  CHECK_THROWS_WITH(read_std_file(file), Catch::Contains("ends too early"));
  std::filesystem::resize_file(file, 8);
  CHECK_THROWS_WITH(read_std_file(file), Catch::Contains("ends too early"));
  std::ofstream(file) << "something else altogether";
  CHECK_THROWS_WITH(read_std_file(file), Catch::Contains("no STD descriptions"));
}

TEST_CASE("LiDARs with a narrow field of view are told from those with an all-round one") {
  CHECK(group_of("vlp-16", "vlp-16") == std::string("same LiDAR"));
  CHECK(group_of("livox-avia", "livox-avia") == std::string("same LiDAR"));
  CHECK(group_of("os1-64", "livox-mid-360") == std::string("wide-wide"));
  CHECK(group_of("os1-64", "livox-avia") == std::string("wide-narrow"));
  CHECK(group_of("aeva-aeries2", "livox-avia") == std::string("narrow-narrow"));
}

TEST_CASE("a row counts what was accepted right and wrong by the pose") {
  const Drive references = drive_along(4);
  const Drive queries = drive_along(5);  // the last without a true place
  Retrieval retrieval;
  retrieval.search_ms = {2.0, 3.0, 4.0, 5.0, 9.0};
  retrieval.loops = {loop(0, 0, 0.9, true, at(0.1, 0.0)),
                     loop(0, 3, 0.2, false, at(0.0, 0.0)),   // not its best
                     loop(1, 2, 0.8, true, at(-10.0, 0.0)),  // right, though not the nearest
                     loop(2, 2, 0.7, true, at(0.0, 5.0)),    // 5 m off
                     loop(3, 3, 0.6, true, at(0.0, 0.0))};
  const PairRow row = score_pair(references, queries, retrieval, 5.0);
  CHECK(row.positives == 4);
  CHECK(row.group == std::string("same LiDAR"));
  CHECK(row.by_pose.operating_point.true_positives == 3);
  CHECK(row.by_pose.operating_point.false_positives == 1);
  CHECK(row.by_pose.recall_at_full_precision == 0.5);
  CHECK(row.search_ms == 4.0);
  CHECK(row.describe_ms == 3.0);
}

TEST_CASE("a row of nothing found has no error, and of another method no times") {
  const Drive drive = drive_along(2);
  const PairRow row = score_pair(drive, drive, {}, 5.0);
  CHECK(std::isnan(row.error_m));
  CHECK(std::isnan(row.describe_ms));
  CHECK(std::isnan(row.search_ms));
}

TEST_CASE("means leave out rows without positives and sum up counts") {
  std::ostringstream out;
  print_rows(out, "town", {row_of("B", 4, 1.0, 3), row_of("B", 2, 0.5, 1), row_of("B", 0, 0.0, 0)});
  CHECK_THAT(out.str(), Catch::Contains("town: database") &&
                            Catch::Contains("| vlp-16 | vlp-16 | B | 4 |") &&
                            Catch::Contains("town, mean") &&
                            Catch::Contains("| same LiDAR | 3 | B | 6 | 0.750") &&
                            Catch::Contains("| 4 / 0 |") && Catch::Contains("| – / 0.00 |"));
}
