// Tests of the place recognition benchmark: metrics, calibration, variants, file formats.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "bench/places/calibration.hpp"
#include "bench/places/common_view.hpp"
#include "bench/places/failures.hpp"
#include "bench/places/pair_row.hpp"
#include "bench/places/quantile.hpp"
#include "bench/places/std_file.hpp"
#include "bench/places/synthetic_place.hpp"
#include "bench/places/variants.hpp"
#include "tests/folders.hpp"
#include "tests/temporary_directory.hpp"

using namespace unimapper;
using namespace unimapper::bench;

namespace {

FineCell cell(float x, float y, float z, bool ground = false) {
  return {{x, y, z}, 1, static_cast<std::uint8_t>(ground ? 1 : 0), 0};
}

Pose at(double x, double y, double yaw = 0.0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {x, y, 0.0}};
}

Keypoint keypoint(float x, float y, std::uint16_t strength) {
  return {{x, y, 1.0F}, Eigen::Vector3f::UnitX(), 0xFF, strength};
}

/// Keyframes 10 m apart on the x axis; what they show is up to the caller.
SceneDrive drive_along(std::size_t keyframes) {
  SceneDrive drive;
  drive.sensor = "vlp-16";
  drive.route = "B";
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    PlaceKeyframe keyframe;
    keyframe.sequence = 100 + i;
    keyframe.T_world_keyframe = at(10.0 * i, 0.0);
    drive.drive.keyframes.push_back(keyframe);
    drive.views.push_back({i, i + 1});
  }
  return drive;
}

DrivePair pair_of(const SceneDrive& references, const SceneDrive& queries) {
  DrivePair pair{"scene", &references, &queries, {}};
  fill_view(pair);
  return pair;
}

TopCandidate top(double confidence, bool right, bool positive) {
  TopCandidate candidate;
  candidate.answered = true;
  candidate.confidence = confidence;
  candidate.right = right;
  candidate.near = positive;
  return candidate;
}

}  // namespace

TEST_CASE("common view is the share of the smaller one's voxels, in the world") {
  const std::vector<FineCell> near_robot = {cell(0.5F, 0.5F, 1.5F), cell(1.5F, 0.5F, 1.5F)};
  const std::vector<FineCell> far_robot = {cell(-9.5F, 0.5F, 1.5F), cell(-8.5F, 0.5F, 1.5F),
                                           cell(-7.5F, 0.5F, 1.5F), cell(-6.5F, 0.5F, 1.5F)};
  const ViewVoxels a = view_voxels(near_robot, at(0.0, 0.0));
  const ViewVoxels b = view_voxels(far_robot, at(11.0, 0.0));
  CHECK(common_view(a, b) == 0.5);
  CHECK(common_view(b, a) == 0.5);
  CHECK(common_view(a, a) == 1.0);
  CHECK(common_view(a, {}) == 0.0);
}

TEST_CASE("ground does not count as common view") {
  CHECK(view_voxels(std::vector<FineCell>{cell(0.5F, 0.5F, 0.0F, true)}, at(0.0, 0.0)).empty());
}

TEST_CASE("repeatability counts only keypoints in the other keyframe's occupied columns") {
  const std::vector<FineCell> cells = {cell(0.25F, 0.25F, 1.0F), cell(10.25F, 0.25F, 1.0F)};
  const OccupiedColumns seen(cells, at(0.0, 0.0), 0.5);
  const std::vector<Eigen::Vector3d> a = {{0.3, 0.3, 0.0}, {10.3, 0.3, 0.0}, {50.0, 0.0, 0.0}};
  // One as near as it must be, whatever its height; one a little too far away.
  const std::vector<Eigen::Vector3d> b = {{0.7, 0.3, 5.0}, {10.3, 0.85, 0.0}};
  CHECK(repeatability({a, seen}, {b, seen}, 0.5) == 0.5);
  CHECK(std::isnan(repeatability({{}, seen}, {{}, seen}, 0.5)));
}

TEST_CASE("a column is near if it or one beside it holds anything") {
  const OccupiedColumns seen(std::vector<FineCell>{cell(0.25F, 0.25F, 1.0F)}, at(5.0, 0.0), 0.5);
  CHECK(seen.near({5.25, 0.25, 0.0}));
  CHECK(seen.near({5.75, -0.25, 9.0}));
  CHECK_FALSE(seen.near({6.25, 0.25, 0.0}));
}

TEST_CASE("halves of two places make a synthetic one, strongest keypoints first") {
  OwnedPlace a;
  a.keypoints = {keypoint(1.0F, 5.0F, 30), keypoint(1.0F, -5.0F, 20)};
  a.planes = {{{0.0F, 4.0F, 1.0F}, Eigen::Vector3f::UnitY()}};
  OwnedPlace b;
  b.keypoints = {keypoint(7.0F, -3.0F, 40), keypoint(8.0F, 2.0F, 10)};
  b.planes = {{{0.0F, 4.0F, 1.0F}, Eigen::Vector3f::UnitY()}};
  const OwnedPlace mixed = mix_halves(a, 0.0, b, 0.0);
  REQUIRE(mixed.keypoints.size() == 2);
  CHECK(mixed.keypoints[0].position.x() == 7.0F);
  CHECK(mixed.keypoints[1].position.x() == 1.0F);
  CHECK(mixed.planes.size() == 1);
}

TEST_CASE("halves are turned before they are cut, normals with them") {
  OwnedPlace a;
  a.keypoints = {keypoint(5.0F, 0.5F, 1)};
  const OwnedPlace quarter = mix_halves(a, 0.5 * std::numbers::pi, {}, 0.0);
  REQUIRE(quarter.keypoints.size() == 1);
  CHECK(quarter.keypoints[0].position.y() == Approx(5.0));
  CHECK(quarter.keypoints[0].normal.y() == Approx(1.0));
  CHECK(mix_halves(a, -0.5 * std::numbers::pi, {}, 0.0).keypoints.empty());
}

TEST_CASE("a synthetic place holds no more than its capacity") {
  OwnedPlace a;
  for (std::uint16_t i = 0; i < 5; ++i) a.keypoints.push_back(keypoint(1.0F, 1.0F, i));
  const OwnedPlace mixed = mix_halves(a, 0.0, a, std::numbers::pi, {7, 0});
  REQUIRE(mixed.keypoints.size() == 7);
  CHECK(mixed.keypoints.back().strength == 1);
}

TEST_CASE("STD's descriptions come back from their file bit by bit") {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "std.places";
  StdKeyframe described;
  described.sequence = 17;
  described.milliseconds = 0.1;
  described.place.keypoints.push_back({{1.0 / 3.0, -2.0, 1e-9}, {0.0, 0.0, 1.0}, 12.0});
  described.place.planes.push_back({{5.0, 6.0, 7.0 / 11.0}, {0.0, 1.0, 0.0}});
  write_std_file(file, {described, {}});
  const auto read = read_std_file(file);
  REQUIRE(read.size() == 2);
  CHECK(read[0].sequence == 17);
  CHECK(read[0].milliseconds == 0.1);
  REQUIRE(read[0].place.keypoints.size() == 1);
  CHECK(read[0].place.keypoints[0].position == described.place.keypoints[0].position);
  CHECK(read[0].place.keypoints[0].count == 12.0);
  REQUIRE(read[0].place.planes.size() == 1);
  CHECK(read[0].place.planes[0].center == described.place.planes[0].center);
  CHECK(read[0].place.planes[0].normal == described.place.planes[0].normal);
  CHECK(read[1].place.keypoints.empty());
}

TEST_CASE("a torn or foreign file of STD's descriptions is refused") {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "std.places";
  write_std_file(file, std::vector<StdKeyframe>(3));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 1);
  CHECK_THROWS_WITH(read_std_file(file), Catch::Contains("ends too early"));
  std::ofstream(file) << "something else altogether";
  CHECK_THROWS_WITH(read_std_file(file), Catch::Contains("no STD descriptions"));
}

TEST_CASE("LiDARs with a narrow field of view are told from those with an all-round one") {
  CHECK(group_of("vlp-16", "vlp-16") == PairGroup::kSame);
  CHECK(group_of("livox-avia", "livox-avia") == PairGroup::kSame);
  CHECK(group_of("os1-64", "livox-mid-360") == PairGroup::kWideWide);
  CHECK(group_of("os1-64", "livox-avia") == PairGroup::kWideNarrow);
  CHECK(group_of("aeva-aeries2", "livox-avia") == PairGroup::kNarrowNarrow);
}

TEST_CASE("a row counts right poses before the first wrong one") {
  const SceneDrive references = drive_along(4);
  const SceneDrive queries = drive_along(4);
  RetrievalResult retrieval;
  retrieval.candidates.push_back({0, 0, 0.9, true, at(0.1, 0.0)});
  retrieval.candidates.push_back({0, 3, 0.2, false, at(0.0, 0.0)});  // not its best
  retrieval.candidates.push_back(
      {1, 2, 0.8, true, at(-10.0, 0.0)});                           // right, though not the nearest
  retrieval.candidates.push_back({2, 2, 0.7, true, at(0.0, 5.0)});  // 5 m off
  retrieval.candidates.push_back({3, 3, 0.6, true, at(0.0, 0.0)});
  const PairRow row = score_pair(pair_of(references, queries), retrieval, {});
  CHECK(row.positives_near == 4);
  CHECK(row.positives_view == 4);
  CHECK(row.loops_at_full_precision == 2);
  CHECK(row.full_precision_from == 0.8);
  CHECK(row.by_pose.operating_point.true_positives == 3);
  CHECK(row.by_pose.operating_point.false_positives == 1);
  REQUIRE(row.top.size() == 4);
  CHECK(row.top[0].match == 0);
  CHECK(row.top[1].right);
  CHECK_FALSE(row.top[2].right);
  CHECK(row.top[2].error_m == Approx(5.0));
  CHECK(row.group == PairGroup::kSame);
}

TEST_CASE("a wrong candidate excludes those of equal confidence") {
  const SceneDrive references = drive_along(2);
  RetrievalResult retrieval;
  retrieval.candidates.push_back({0, 0, 0.7, true, at(0.0, 0.0)});
  retrieval.candidates.push_back({1, 1, 0.7, true, at(0.0, 5.0)});
  const PairRow row = score_pair(pair_of(references, references), retrieval, {});
  CHECK(row.loops_at_full_precision == 0);
  CHECK(row.full_precision_from > 1.0);
}

TEST_CASE("common views are those of the drives' keyframes") {
  const SceneDrive drive = drive_along(3);
  const DrivePair pair = pair_of(drive, drive);
  CHECK(pair.view_of(1, 1) == 1.0);
  CHECK(pair.view_of(1, 2) == 0.5);
  CHECK(pair.view_of(0, 2) == 0.0);
  CHECK(pair.best_view(2) == 2);
}

TEST_CASE("bins of confidence, and the precision of a threshold at their lower end") {
  PairRow row;
  row.top = {top(1.0, true, true),  top(0.95, true, true),  top(0.55, true, true),
             top(0.5, false, true), top(0.0, false, false), TopCandidate{}};
  const auto bins = calibrate({row});
  REQUIRE(bins.size() == 10);
  CHECK(bins[9].answers == 2);
  CHECK(bins[5].answers == 2);
  CHECK(bins[5].right_share() == 0.5);
  CHECK(bins[5].right_share_above() == 0.75);
  CHECK(bins[0].answers == 1);
  CHECK(bins[0].right_share_above() == Approx(0.6));
  CHECK(std::isnan(bins[3].right_share()));
}

TEST_CASE("false loops by confidence come before missed ones by common view") {
  PairRow row;
  const auto missed = [](double best_view) {
    TopCandidate candidate = top(0.1, false, true);
    candidate.view = true;
    candidate.best_view = best_view;
    return candidate;
  };
  row.top = {missed(0.4), top(0.98, false, true), top(1.0, true, true), missed(0.9),
             top(0.99, false, false)};
  for (TopCandidate& candidate : row.top) candidate.accepted = candidate.confidence > 0.9;
  const std::vector<PairRow> rows = {row};
  const auto failures = failures_of(rows);
  REQUIRE(failures.size() == 4);
  CHECK(failures[0].top->confidence == 0.99);
  CHECK(std::string(failures[0].why) == "accepted, without a true match");
  CHECK(failures[1].top->confidence == 0.98);
  CHECK(failures[2].top->best_view == 0.9);
  CHECK(failures[3].top->best_view == 0.4);
}

TEST_CASE("a pooled curve puts all rows under one threshold") {
  PairRow a;
  a.top = {top(0.9, true, true), top(0.3, false, true)};
  PairRow b;
  b.top = {top(0.6, false, true), top(0.5, true, true)};
  const auto curve = pooled_curve({&a, &b}, &TopCandidate::near);
  REQUIRE(curve.size() == 4);
  CHECK(curve[0].precision == 1.0);
  CHECK(curve[0].recall == 0.25);
  CHECK(curve[1].precision == 0.5);
  CHECK(curve[2].recall == 0.5);
  CHECK(curve[3].precision == 0.5);
  CHECK(pooled_curve({&a}, &TopCandidate::view).empty());
}

TEST_CASE("ranks ignore the factors that they name") {
  LoopCandidate candidate;
  candidate.confidence = 0.5F;
  candidate.votes = 8;
  candidate.plane_overlap = 0.25F;
  CHECK(rank_of(candidate, Rank::kConfidence) == 0.5);
  CHECK(rank_of(candidate, Rank::kVotes) == 8.0);
  CHECK(rank_of(candidate, Rank::kVotesOverlap) == 2.0);
  CHECK(rank_of(candidate, Rank::kWithoutOverlap) == 2.0);
}

TEST_CASE("the list of variants begins with the default and computes each description once") {
  const std::filesystem::path root = unimapper::testing::source_folder();
  const auto variants = read_variants(root / "bench/places/variants.json", PipelineConfig{});
  REQUIRE(variants.size() > 3);
  CHECK(variants[0].name == "default");
  CHECK(variants[0].described_as == 0);
  std::size_t descriptions = 0;
  for (const Variant& variant : variants) {
    CHECK(variant.described_as <= descriptions);
    descriptions = std::max(descriptions, variant.described_as + 1);
  }
  CHECK(descriptions == 3);  // the default, without removal, in the world's frame
}

TEST_CASE("variants with unknown members are refused") {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "variants.json";
  const auto read = [&](const char* text) {
    std::ofstream(file) << text;
    return read_variants(file, PipelineConfig{});
  };
  CHECK_THROWS_WITH(read(R"([{"colour": 1}])"), Catch::Contains("colour"));
  CHECK_THROWS_WITH(read(R"([{"rank": "beauty"}])"), Catch::Contains("beauty"));
  CHECK_THROWS_WITH(read(R"([{"config": {"loop": 1}}])"), Catch::Contains("loop"));
  CHECK_THROWS_WITH(read("[]"), Catch::Contains("no variant"));
  CHECK_THROWS_AS(read("{"), std::runtime_error);
}

TEST_CASE("quantiles and means of few values") {
  CHECK(median({3.0, 1.0, 2.0}) == 2.0);
  CHECK(quantile({1.0, 2.0, 3.0, 4.0, 5.0}, 0.99) == 5.0);
  CHECK(std::isnan(median({})));
  CHECK(mean({1.0, std::nan(""), 3.0}) == 2.0);
  CHECK(std::isnan(mean({})));
}
