// Tests of parameter files in JSON.
#include "unimapper/onboard/config.hpp"

#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace {

const Words kDump = {"onboard", "--dump-config"};

CommandResult with_config(const std::string& text) {
  const TemporaryDirectory directory;
  return run_unimapper(kDump, {"--config", directory.write("robot.json", text)});
}

}  // namespace

TEST_CASE("presets differ by sensor and by kind, and a dumped one reads back as the same") {
  std::set<std::string> dumps;
  for (const auto& [sensor, kind] :
       {std::pair{"avia", "default"}, {"os2-128", "default"}, {"avia", "paper"}}) {
    const std::string dump = run_unimapper(kDump, {"--sensor", sensor, "--preset", kind}).out;
    CHECK(with_config(dump).out == dump);
    CHECK(dumps.insert(dump).second);
  }
}

TEST_CASE("a file changes what it names and nothing else") {
  auto expected = nlohmann::json::parse(run_unimapper(kDump).out);
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

TEST_CASE("a wrong or missing file is refused with its name and the key") {
  const struct {
    const char* text;
    const char* message;
  } wrong[] = {
      {R"({"keyframe": {"scan": 5}})",
       "keyframe.scan is no parameter; did you mean keyframe.scans?"},
      {R"({"window": 5})", "window is no parameter; did you mean removal.window?"},
      {R"({"clock_ns": 5})", "clock_ns is no parameter"},
      {R"({"keyframe": 5})", "keyframe must be an object"},
      {R"({"keyframe": {"scans": -5}})", "keyframe.scans is -5 but must lie in [1, 32] scans"},
      {R"({"keyframe": {"scans": 1.5}})", "keyframe.scans is 1.5 but must lie in"},
      {R"({"keyframe": {"scans": 4294967297}})", "keyframe.scans is 4294967297 but"},
      {R"({"keyframe": {"range_min_m": "1"}})", "keyframe.range_min_m is \"1\" but must lie in"},
      {R"({"keyframe": {"range_min_m": 1e300}})", "keyframe.range_min_m is 1e+300 but"},
      {R"({"removal": {"components": 1}})", "removal.components is 1 but must be true or false"},
      {R"({"search_scope": {"sessions": "some"}})",
       "search_scope.sessions is some but must be one of all only_same only_other"},
      {R"({"keyframe": {"range_min_m": 200}})", "must be below keyframe.range_max_m"},
      {"[]", "must be an object"},
      {"{", "parse error"},
      {"", "parse error"},
  };
  for (const auto& [text, message] : wrong) {
    const CommandResult result = with_config(text);
    check_fails(result, message);
    CHECK(result.out.empty());
    CHECK_THAT(result.err, Contains("robot.json: "));
  }
  check_fails(run_unimapper(kDump, {"--config", "nowhere.json"}), "nowhere.json: no such file");
}
