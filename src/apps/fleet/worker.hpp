// Worker of a fleet: verifies loops that merges on other machines ask for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "ports/nats/job_board.hpp"
#include "ports/nats/server.hpp"
#include "ports/store/latencies.hpp"
#include "src/apps/fleet/keyframe_files.hpp"
#include "src/merge/jobs/loop_worker.hpp"

namespace unimapper::apps {

/// What a worker has done since its start.
struct WorkerCounters {
  std::uint64_t loops = 0;      ///< verified
  std::uint64_t jobs = 0;       ///< answered, whatever the answer
  std::uint64_t faults = 0;     ///< jobs of these that could not be done
  std::uint64_t keyframes = 0;  ///< fetched from the server
  std::uint64_t failures = 0;   ///< connections that ended with a reason
  store::Latencies job_times;   ///< of each job, from its arrival to its answer
};

/// All of them as Prometheus reads them.
std::string metrics_text(const WorkerCounters& counters);

/// Answers of one worker. Not thread safe.
class FleetWorker {
 public:
  /// `files` must outlive it; `max_bytes`, `threads`: as of `merge::LoopWorker`.
  FleetWorker(std::string name, KeyframeFiles& files, std::uint64_t max_bytes,
              std::uint32_t threads);

  /// Takes a job, if one comes in time, and answers it. Whatever is wrong with a job is answered.
  /// Returns the loops that it had. Throws nats_port::NatsError.
  std::size_t work(nats_port::JobSource& source, std::chrono::milliseconds wait);
  /// Totals so far; `failures` are not its own.
  [[nodiscard]] const WorkerCounters& counters() const { return counters_; }

 private:
  std::string name_;
  KeyframeFiles& files_;
  nats_port::JobSource* source_ = nullptr;  ///< while it works
  WorkerCounters counters_;
  merge::LoopWorker worker_;
};

/// Of `unimapper worker`.
struct WorkerOptions {
  nats_port::Server server;
  std::filesystem::path folder;    ///< for keyframes; empty: none
  std::uint32_t disk_mb = 10'000;  ///< of keyframes in it
  std::uint32_t memory_mb = 1000;  ///< of keyframes and clouds
  std::uint32_t threads = 0;       ///< 0: as many as the machine has
  std::string http;                ///< HOST:PORT of /metrics; empty: none
};

/// What workers must have in common with a merge to come to the same outcomes.
std::string worker_version();

/// Works until SIGINT or SIGTERM; looks for the server again whenever it is gone.
void run_worker(const WorkerOptions& options);

}  // namespace unimapper::apps
