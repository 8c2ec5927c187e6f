// Tests of parameter files in JSON.
#include "unimapper/onboard/config.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/apps/command.hpp"
#include "tests/member_count.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::test;
using Catch::Matchers::Contains;

namespace {

nlohmann::json dumped() {
  return nlohmann::json::parse(run_unimapper({"onboard", "--dump-config"}).out);
}

CommandResult with_config(const std::string& text, std::vector<std::string> more = {}) {
  const TemporaryDirectory directory;
  write_text(directory.path() / "robot.json", text);
  std::vector<std::string> arguments = {"onboard", "--dump-config", "--config",
                                        (directory.path() / "robot.json").string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_unimapper(arguments);
}

}  // namespace

TEST_CASE("the dumped configuration holds every parameter") {
  const auto config = dumped();
  CHECK(config["keyframe"].size() == member_count<KeyframeConfig>());
  CHECK(config["voxel"].size() == member_count<VoxelConfig>());
  CHECK(config["ground"].size() == member_count<GroundConfig>());
  CHECK(config["free_space"].size() == member_count<FreeSpaceConfig>());
  CHECK(config["removal"].size() == member_count<RemovalConfig>());
  CHECK(config["descriptor"].size() == member_count<DescriptorConfig>());
  CHECK(config["loop_search"].size() == member_count<LoopSearchConfig>());
  CHECK(config["loop_search"]["triangles"].size() == member_count<TriangleConfig>());
  CHECK(config["search_scope"].size() == member_count<SearchScope>());
  CHECK(config.size() == member_count<PipelineConfig>() - 2);  // all but the clock and the ring
}

TEST_CASE("what is dumped reads back as the same") {
  for (const char* preset : {"default", "paper"}) {
    const std::string text =
        run_unimapper({"onboard", "--dump-config", "--sensor", "avia", "--preset", preset}).out;
    CHECK(with_config(text).out == text);
  }
}

TEST_CASE("presets differ by sensor and by kind") {
  const auto dump = [](const std::string& sensor, const std::string& preset) {
    return run_unimapper({"onboard", "--dump-config", "--sensor", sensor, "--preset", preset}).out;
  };
  CHECK(dump("avia", "default") != dump("os2-128", "default"));
  CHECK(dump("avia", "default") != dump("avia", "paper"));
}

TEST_CASE("a file changes what it names and nothing else") {
  auto expected = dumped();
  const auto result = with_config(
      R"({"keyframe": {"scans": 5}, "removal": {"log_odds_free": 0.7, "components": false},
          "search_scope": {"sessions": "only_same"}})");
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  expected["keyframe"]["scans"] = 5;
  expected["removal"]["log_odds_free"] = 0.7;
  expected["removal"]["components"] = false;
  expected["search_scope"]["sessions"] = "only_same";
  CHECK(nlohmann::json::parse(result.out) == expected);
}

TEST_CASE("a wrong file is refused with its name and the key") {
  const auto refused = [](const std::string& text, const std::string& message) {
    const CommandResult result = with_config(text);
    CHECK(result.exit_code == 1);
    CHECK(result.out.empty());
    CHECK_THAT(result.err, Contains("robot.json: ") && Contains(message));
  };
  refused(R"({"keyframe": {"scan": 5}})", "keyframe.scan: is no parameter");
  refused(R"({"clock_ns": 5})", "clock_ns: is no parameter");
  refused(R"({"keyframe": 5})", "keyframe: must be an object");
  refused(R"({"keyframe": {"scans": -5}})", "keyframe.scans: must be a whole number");
  refused(R"({"keyframe": {"scans": 4294967296}})", "keyframe.scans: must be a whole number");
  refused(R"({"keyframe": {"range_min_m": "1"}})", "keyframe.range_min_m: must be a number");
  refused(R"({"keyframe": {"range_min_m": 1e300}})", "keyframe.range_min_m: is out of range");
  refused(R"({"removal": {"components": 1}})", "removal.components: must be true or false");
  refused(R"({"search_scope": {"sessions": "some"}})", "search_scope.sessions: must be");
  refused(R"({"keyframe": {"scans": 0}})", "scans");
  refused("[]", "must be an object");
  refused("{", "parse error");
  refused("", "parse error");
}

TEST_CASE("a configuration file that is not there is reported") {
  const auto result = run_unimapper({"onboard", "--dump-config", "--config", "nowhere.json"});
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, Contains("nowhere.json: no such file"));
}
