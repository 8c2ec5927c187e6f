// End-to-end tests of `unimapper rt-check`.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/apps/command.hpp"

using namespace unimapper::apps;
using Catch::Matchers::Contains;

TEST_CASE("rt-check reports checks, measurements and the result as JSON") {
  const CommandResult result = run_unimapper({"rt-check", "--seconds", "0.2", "--json"});
  INFO(result.out << result.err);
  const auto report = nlohmann::json::parse(result.out);
  bool refused = false;
  for (const char* name : {"sched_fifo", "affinity", "mlockall", "preempt_rt", "rt_throttling",
                           "cpu_governor", "clock", "rmem_max", "transparent_huge_pages"}) {
    INFO(name);
    const auto& check = report.at("checks").at(name);
    CHECK_FALSE(check.at("value").get<std::string>().empty());
    const auto status = check.at("status").get<std::string>();
    // Every check that is not good has an advice.
    CHECK((status == "good") == check.at("advice").get<std::string>().empty());
    refused = refused || status == "refused";
  }
  CHECK(report.at("ready") == !refused);
  CHECK(result.exit_code == (refused ? 1 : 0));
  CHECK(result.err.empty() == !refused);

  const auto& wakeup = report.at("wakeup");
  CHECK(wakeup.at("wakeups").get<int>() >= 1);
  CHECK(wakeup.at("wakeups").get<int>() <= 200);
  CHECK(wakeup.at("p50_us").get<double>() >= 0.0);
  CHECK(wakeup.at("p50_us").get<double>() <= wakeup.at("p99_us").get<double>());
  CHECK(wakeup.at("p99_us").get<double>() <= wakeup.at("max_us").get<double>());
  CHECK(report.at("prefault").at("faults_while_prefaulting").get<int>() >= 1);
  CHECK(report.at("prefault").at("faults_afterwards").get<int>() == 0);
}

TEST_CASE("rt-check prints text without --json") {
  const CommandResult result = run_unimapper({"rt-check", "--seconds", "0.1"});
  CHECK_THAT(result.out, Contains("sched_fifo") && Contains("wake-up latency") &&
                             Contains("page faults while prefaulting"));
}

TEST_CASE("rt-check ends with 1 and names what is refused") {
  // No computer has a core of this number.
  const CommandResult result = run_unimapper({"rt-check", "--seconds", "0.1", "--core", "1023"});
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, Contains("affinity"));
  CHECK_THAT(result.out, Contains("no such core"));
}
