// `unimapper rt-check`: the command line of the real-time capability check.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "src/apps/commands.hpp"
#include "src/apps/rt_check/report.hpp"

namespace unimapper::apps {

namespace {

struct RtCheckOptions {
  double seconds = 2.0;
  int priority = 80;
  int core = 0;
  bool json = false;
};

void run_rt_check(const RtCheckOptions& options) {
  constexpr std::size_t kPrefaultBytes = std::size_t{4} << 20U;
  RtReport report;
  report.findings = linux_port::inspect_host(options.priority, options.core);
  report.wakeup = linux_port::measure_wakeups(
      {.duration = std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * options.seconds)),
       .interval = std::chrono::microseconds(1000),
       .priority = options.priority,
       .core = options.core});
  report.prefault = linux_port::try_prefault(kPrefaultBytes);
  std::fputs((options.json ? report.to_json() : report.to_text()).c_str(), stdout);
  const std::string refused = report.refused();
  if (!refused.empty()) {
    throw std::runtime_error("this computer refuses what real-time operation needs: " + refused);
  }
}

}  // namespace

void register_rt_check(CLI::App& app) {
  auto options = std::make_shared<RtCheckOptions>();
  CLI::App* command =
      app.add_subcommand("rt-check", "Check what this computer allows a real-time thread");
  command->add_option("--seconds", options->seconds, "How long to measure wake-ups (0.1 to 10)")
      ->check(CLI::Range(0.1, 10.0))
      ->capture_default_str();
  command->add_option("--priority", options->priority, "SCHED_FIFO priority to try (1 to 99)")
      ->check(CLI::Range(1, 99))
      ->capture_default_str();
  command->add_option("--core", options->core, "Core to pin to, from 0")
      ->check(CLI::Range(0, 1023))
      ->capture_default_str();
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer(
      "Ends with 0 if SCHED_FIFO, pinning and locked memory are granted, with 1 if not.\n"
      "Example:\n"
      "  unimapper rt-check --core 1 --seconds 5");
  command->callback([options] { run_rt_check(*options); });
}

}  // namespace unimapper::apps
