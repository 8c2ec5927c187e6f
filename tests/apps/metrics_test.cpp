// Tests of a base's counters as Prometheus reads them
#include "src/apps/base/metrics.hpp"

#include <regex>
#include <sstream>

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

TEST_CASE("each metric has its help, its type and one value", "[metrics]") {
  BaseCounters counters;
  counters.received.keyframes_damaged = 3;
  counters.stored.keyframes = 12;
  counters.stored.longest_commit = std::chrono::milliseconds(1500);
  counters.uplink.emplace().too_large = 2;
  std::vector<wire::SessionProgress> sessions(2);
  sessions[0].info.id.robot = 1;
  sessions[0].announced = 9;
  sessions[0].received = 7;
  sessions[1].info.id.robot = 2;
  sessions[1].ended = true;

  const std::string text = metrics_text(counters, sessions);
  for (const char* line :
       {"unimapper_keyframes_damaged_total 3\n", "unimapper_keyframes_stored_total 12\n",
        "unimapper_commit_seconds_max 1.5\n", "unimapper_uplink_too_large_total 2\n",
        "unimapper_robots 2\n", "unimapper_sessions_open 1\n", "unimapper_keyframes_missing 2\n"}) {
    CHECK_THAT(text, Contains(line));
  }
  CHECK(text.find("downlink") == std::string::npos);
  const std::regex metric("# HELP (\\w+) .+\n# TYPE \\1 (counter|gauge)\n\\1 [0-9.e+-]+\n");
  CHECK(std::regex_replace(text, metric, "").empty());
}
