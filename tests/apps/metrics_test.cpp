// Tests of a base's counters as Prometheus reads them
#include "src/apps/base/metrics.hpp"

#include <regex>
#include <sstream>

#include "src/apps/fleet/worker.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace {

/// What is left of a text when all that Prometheus reads is taken away.
std::string without_metrics(const std::string& text) {
  const std::string number = "[0-9.e+-]+\n";
  const std::regex value("# HELP (\\w+) .+\n# TYPE \\1 (counter|gauge)\n\\1 " + number);
  const std::regex times(
      "# HELP (\\w+) .+\n# TYPE \\1 histogram\n(\\1_bucket\\{le=\"[0-9.]+\"\\} " + number +
      ")+\\1_bucket\\{le=\"\\+Inf\"\\} " + number + "\\1_sum " + number + "\\1_count " + number);
  return std::regex_replace(std::regex_replace(text, value, ""), times, "");
}

}  // namespace

TEST_CASE("each metric has its help, its type and its values", "[metrics]") {
  BaseCounters counters;
  counters.received.keyframes_damaged = 3;
  counters.stored.keyframes = 12;
  counters.stored.longest_commit = std::chrono::milliseconds(1500);
  counters.stored.commit_times.add(std::chrono::milliseconds(1500));
  counters.stored.commit_times.add(std::chrono::milliseconds(10));
  counters.stored.waits.add(std::chrono::hours(1));
  counters.received.overflowed = 5;
  counters.uplink.emplace().too_large = 2;
  counters.uplink->waiting = 8;
  counters.merges.emplace().longest_merge = std::chrono::milliseconds(2500);
  counters.epoch = 4;
  std::vector<wire::SessionProgress> sessions(2);
  sessions[0].info.id.robot = 1;
  sessions[0].announced = 9;
  sessions[0].received = 7;
  sessions[0].dropped = 1;
  sessions[1].info.id.robot = 2;
  sessions[1].ended = true;

  const std::string text = metrics_text(counters, sessions);
  for (const char* line :
       {"unimapper_keyframes_damaged_total 3\n", "unimapper_keyframes_stored_total 12\n",
        "unimapper_commit_seconds_max 1.5\n", "unimapper_uplink_too_large_total 2\n",
        "unimapper_robots 2\n", "unimapper_sessions_open 1\n", "unimapper_keyframes_missing 2\n",
        "unimapper_commit_seconds_bucket{le=\"0.003\"} 0\n",
        "unimapper_commit_seconds_bucket{le=\"0.01\"} 1\n",
        "unimapper_commit_seconds_bucket{le=\"3\"} 2\n", "unimapper_commit_seconds_sum 1.51\n",
        "unimapper_commit_seconds_count 2\n",
        "unimapper_keyframe_wait_seconds_bucket{le=\"100\"} 0\n",
        "unimapper_keyframe_wait_seconds_bucket{le=\"+Inf\"} 1\n",
        "unimapper_datagrams_dropped_total 5\n", "unimapper_uplink_waiting 8\n",
        "unimapper_keyframes_dropped_by_robots 1\n", "unimapper_merge_seconds_max 2.5\n",
        "unimapper_epoch 4\n"}) {
    CHECK_THAT(text, Contains(line));
  }
  CHECK(text.find("downlink") == std::string::npos);
  CHECK(without_metrics(text).empty());
}

TEST_CASE("a worker's metrics likewise", "[metrics]") {
  WorkerCounters counters;
  counters.loops = 40;
  counters.job_times.add(std::chrono::milliseconds(200));
  const std::string text = metrics_text(counters);
  CHECK_THAT(text, Contains("unimapper_worker_loops_total 40\n"));
  CHECK_THAT(text, Contains("unimapper_worker_job_seconds_bucket{le=\"0.3\"} 1\n"));
  CHECK(without_metrics(text).empty());
}
