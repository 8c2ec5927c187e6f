// Tests of parameter files in JSON.
#include "unimapper/onboard/config.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
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

TEST_CASE("a dumped configuration reads back as the same") {
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
  refused(R"({"keyframe": {"scan": 5}})",
          "keyframe.scan is no parameter; did you mean keyframe.scans?");
  refused(R"({"window": 5})", "window is no parameter; did you mean removal.window?");
  refused(R"({"clock_ns": 5})", "clock_ns is no parameter");
  refused(R"({"keyframe": 5})", "keyframe must be an object");
  refused(R"({"keyframe": {"scans": -5}})", "keyframe.scans is -5 but must lie in [1, 32] scans");
  refused(R"({"keyframe": {"scans": 1.5}})", "keyframe.scans is 1.5 but must lie in");
  refused(R"({"keyframe": {"scans": 4294967297}})", "keyframe.scans is 4294967297 but");
  refused(R"({"keyframe": {"range_min_m": "1"}})", "keyframe.range_min_m is \"1\" but must lie in");
  refused(R"({"keyframe": {"range_min_m": 1e300}})", "keyframe.range_min_m is 1e+300 but");
  refused(R"({"removal": {"components": 1}})", "removal.components is 1 but must be true or false");
  refused(R"({"search_scope": {"sessions": "some"}})",
          "search_scope.sessions is some but must be one of all only_same only_other");
  refused(R"({"keyframe": {"range_min_m": 200}})", "must be below keyframe.range_max_m");
  refused("[]", "must be an object");
  refused("{", "parse error");
  refused("", "parse error");
}

TEST_CASE("a configuration file that is not there is reported") {
  const auto result = run_unimapper({"onboard", "--dump-config", "--config", "nowhere.json"});
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, Contains("nowhere.json: no such file"));
}
