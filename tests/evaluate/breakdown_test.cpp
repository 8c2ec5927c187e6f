// Tests of `unimapper evaluate breakdown`.
#include <catch2/catch.hpp>

#include "ports/datasets/writers.hpp"
#include "src/apps/evaluate/evaluate.hpp"
#include "tests/temporary_directory.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

constexpr std::uint32_t kKept = 9;
constexpr std::uint32_t kRemoved = 251;

/// The result of a drive of one scan: a car of three points at 5 m, a wall of two at 15 m.
fs::path write_result(const fs::path& folder, const std::string& name,
                      const std::vector<std::uint32_t>& labels) {
  const fs::path drive = folder / name;
  for (const char* part : {"scans", "labels", "run/labels"}) fs::create_directories(drive / part);
  datasets::write_kitti_scan(
      drive / "scans/000000.bin",
      std::vector<datasets::Scan::Point>{
          {5, 0, 0, 0}, {5, 1, 0, 0}, {5, 2, 0, 0}, {15, 0, 0, 0}, {15, 1, 0, 0}});
  datasets::write_kitti_poses(drive / "poses.txt", std::vector<Pose>(1));
  const std::uint32_t car = (3U << 16U) | 252U;
  datasets::write_labels(drive / "labels/000000.label",
                         std::vector<std::uint32_t>{car, car, car, 50, 50});
  datasets::write_labels(drive / "run/labels/000000.label", labels);
  datasets::write_text(folder / (name + ".json"), evaluate_dynamic({drive, drive / "run"}));
  return folder / (name + ".json");
}

}  // namespace

TEST_CASE("a breakdown counts the points of all drives together") {
  TemporaryDirectory folder;
  EvaluateBreakdownOptions options;
  options.label = "both";
  options.results = {
      write_result(folder.path(), "a", {kRemoved, kRemoved, kRemoved, kKept, kRemoved}),
      write_result(folder.path(), "b", {kRemoved, kKept, kKept, kKept, kKept})};
  CHECK(evaluate_breakdown(options) == "| both | – / – | – / – | 66.67 / 66.67 | – / – |\n");
  options.by = "range";
  CHECK(evaluate_breakdown(options) ==
        "| both | – / 66.67 | 75.00 / – | – / – | – / – | – / – | – / – |\n");
}

TEST_CASE("a breakdown without results is the header of its table") {
  EvaluateBreakdownOptions options;
  CHECK_THAT(evaluate_breakdown(options), Contains("| pedestrian | cyclist | car | bus, truck |") &&
                                              Contains("\n|---|---|---|---|---|\n"));
  options.by = "range";
  CHECK_THAT(evaluate_breakdown(options), Contains("| 0-10 m |") && Contains("| 80+ m |"));
}

TEST_CASE("a breakdown refuses what is no result") {
  TemporaryDirectory folder;
  EvaluateBreakdownOptions options;
  options.results = {folder.path() / "a.json"};
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("a.json: no such file"));
  datasets::write_text(folder.path() / "a.json", "{}");
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("is no result of"));
  datasets::write_text(folder.path() / "a.json", "{");
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("a.json"));
  options.by = "colour";
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("only by class or range"));
}
