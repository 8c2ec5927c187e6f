// `unimapper worker`: a worker of a fleet.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <thread>

#include "src/apps/fleet/worker.hpp"
#include "src/apps/prometheus_text.hpp"
#include "src/apps/say.hpp"
#include "src/apps/stop_signals.hpp"
#include "src/apps/view/view_server.hpp"
#include "src/merge/loops/loop_fingerprint.hpp"

namespace unimapper::apps {
namespace {

/// How long a signal may wait.
constexpr std::chrono::milliseconds kJobWait{500};
/// How often an idle worker looks for whom jobs wait.
constexpr int kIdleRounds = 20;
constexpr std::chrono::milliseconds kFirstPause{500};
constexpr std::chrono::milliseconds kLongestPause{30'000};

std::string own_name() {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  return fmt::format("{}:{}", host.data(), getpid());
}

/// Waits, unless a signal comes.
void pause(StopSignals& stop, std::chrono::milliseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!stop.arrived() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

/// Says once for which other versions jobs wait.
void tell_versions(nats_port::JobSource& source, std::string& told) {
  std::string others;
  for (const std::string& version : source.versions_wanted()) {
    if (version != worker_version()) others += (others.empty() ? "" : ", ") + version;
  }
  if (!others.empty() && others != told) {
    say("warning: jobs wait for workers of version " + others + "; this one is " +
        worker_version() + " and takes none of them");
  }
  told = others;
}

}  // namespace

std::string worker_version() {
  std::string version = fmt::format("{}-{}", UNIMAPPER_VERSION, merge::kLoopVerificationVersion);
  std::replace(version.begin(), version.end(), '.', '_');
  return version;
}

void run_worker(const WorkerOptions& options) {
  StopSignals stop;
  check(options.server);
  LatestMetrics metrics;
  std::unique_ptr<ViewServer> http;
  if (!options.http.empty()) {
    http = std::make_unique<ViewServer>(
        ViewServerOptions{options.http, {}, {}, [&metrics] { return metrics.get(); }});
    say("counters are at " + http->url() + "metrics");
  }
  KeyframeFiles files(options.folder, std::uint64_t{options.disk_mb} * 1'000'000);
  FleetWorker worker(own_name(), files, std::uint64_t{options.memory_mb} * 1'000'000,
                     options.threads);
  std::uint64_t failures = 0;
  const auto tell_metrics = [&] {
    WorkerCounters counters = worker.counters();
    counters.failures = failures;
    metrics.set(metrics_text(counters));
  };
  tell_metrics();
  std::string told;
  std::string trouble;
  std::chrono::milliseconds wait = kFirstPause;
  while (!stop.arrived()) {
    try {
      const auto source = nats_port::open_source(options.server, worker_version());
      say((trouble.empty() ? "waits for jobs at " : "back at ") + shown(options.server));
      trouble.clear();
      wait = kFirstPause;
      for (int idle = 0; !stop.arrived();) {
        const std::size_t done = worker.work(*source, kJobWait);
        if (done > 0) tell_metrics();
        idle = done > 0 ? 0 : idle + 1;
        if (idle % kIdleRounds == 1) tell_versions(*source, told);
      }
    } catch (const std::exception& error) {
      if (trouble != error.what()) say(std::string("warning: ") + error.what() + "; tries again");
      trouble = error.what();
      ++failures;
      tell_metrics();
      pause(stop, wait);
      wait = std::min(2 * wait, kLongestPause);
    }
  }
  std::cout << worker.counters().loops << " loops verified\n";
}

}  // namespace unimapper::apps
