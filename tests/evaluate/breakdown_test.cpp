// Tests of `unimapper evaluate breakdown`.
#include "src/apps/evaluate/evaluate.hpp"
#include "tests/evaluate/labelled_scan.hpp"
#include "tests/evaluate/small_folders.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::evaluate::testing;
using namespace unimapper::test;
using Catch::Matchers::Contains;

namespace {

/// The result of a drive of one scan: a car of three points at 5 m, a wall of two at 15 m.
std::filesystem::path write_result(const TemporaryDirectory& folder, const std::string& name,
                                   const std::vector<std::uint32_t>& labels) {
  const auto drive = folder / name;
  const std::uint32_t car = (3U << 16U) | 252U;
  write_dataset(drive, {at(0)},
                {{5, 0, 0, 0}, {5, 1, 0, 0}, {5, 2, 0, 0}, {15, 0, 0, 0}, {15, 1, 0, 0}},
                {car, car, car, kWall, kWall});
  write_run_labels(drive / "run", 1, labels);
  return folder.write(name + ".json", evaluate_dynamic({drive, drive / "run"}));
}

}  // namespace

TEST_CASE("a breakdown counts the points of all drives together") {
  TemporaryDirectory folder;
  EvaluateBreakdownOptions options;
  options.label = "both";
  options.results = {write_result(folder, "a", {kRemoved, kRemoved, kRemoved, kKept, kRemoved}),
                     write_result(folder, "b", {kRemoved, kKept, kKept, kKept, kKept})};
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
  options.results = {folder / "a.json"};
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("a.json: no such file"));
  folder.write("a.json", "{}");
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("is no result of"));
  folder.write("a.json", "{");
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("a.json"));
  options.by = "colour";
  CHECK_THROWS_WITH(evaluate_breakdown(options), Contains("only by class or range"));
}
