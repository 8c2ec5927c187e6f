// List scheduling of jobs of loop verification by workers that share a link.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <vector>

#include "ports/nats/lane_choice.hpp"
#include "unimapper/core/ids.hpp"

namespace unimapper::bench {

/// From the board to the worker and back, as measured on loopback and on one switch, seconds.
inline constexpr double kJobS = 0.003;

/// What a worker has to do.
struct Job {
  std::uint32_t lane = 0;
  std::set<KeyframeId> read;    ///< keyframes that it needs
  std::set<KeyframeId> clouds;  ///< of them, those of its questions
  std::size_t loops = 0;
};

/// Seconds of the parts of jobs.
struct Costs {
  double keyframe = 0.0;
  double cloud = 0.0;
  double loop = 0.0;
};

/// When all is done, and with what.
struct Schedule {
  double end_s = 0.0;
  double busy_s = 0.0;  ///< of all workers
  std::size_t clouds = 0;
};

/// The first worker that is free takes the next job of the lane that it chooses. `calls`: jobs of
/// each call; all of one are done before the next one. `bytes_of`: of a keyframe on the link.
inline Schedule scheduled(const std::vector<std::vector<Job>>& calls,
                          const std::function<std::uint64_t(KeyframeId)>& bytes_of,
                          std::size_t workers, const Costs& costs, double link_bytes_per_s) {
  struct Worker {
    double free_s = 0.0;
    std::set<KeyframeId> read, clouds;
    nats_port::LaneChoice lanes;
  };
  std::vector<Worker> all;
  for (std::uint32_t i = 0; i < workers; ++i)
    all.push_back({0.0, {}, {}, nats_port::LaneChoice(5 * i)});
  Schedule schedule;
  double link_free_s = 0.0;
  for (const std::vector<Job>& jobs : calls) {
    for (Worker& worker : all) worker.free_s = schedule.end_s;
    std::map<std::uint32_t, std::deque<const Job*>> lanes;
    for (const Job& job : jobs) lanes[job.lane].push_back(&job);
    while (!lanes.empty()) {
      Worker& worker =
          *std::min_element(all.begin(), all.end(),
                            [](const Worker& a, const Worker& b) { return a.free_s < b.free_s; });
      std::map<std::uint32_t, std::uint64_t> waiting;
      for (const auto& [lane, left] : lanes) waiting[lane] = left.size();
      const std::uint32_t lane = worker.lanes.order(waiting).front();
      worker.lanes.take(lane);
      const Job& job = *lanes[lane].front();
      lanes[lane].pop_front();
      if (lanes[lane].empty()) lanes.erase(lane);
      double work_s = costs.loop * static_cast<double>(job.loops);
      double bytes = 0.0;
      for (const KeyframeId k : job.read) {
        if (!worker.read.insert(k).second) continue;
        work_s += costs.keyframe;
        bytes += static_cast<double>(bytes_of(k));
      }
      for (const KeyframeId k : job.clouds) {
        if (!worker.clouds.insert(k).second) continue;
        work_s += costs.cloud;
        ++schedule.clouds;
      }
      link_free_s = std::max(link_free_s, worker.free_s) + bytes / link_bytes_per_s;
      worker.free_s = std::max(worker.free_s, link_free_s) + work_s + kJobS;
      schedule.busy_s += work_s;
    }
    for (const Worker& worker : all) schedule.end_s = std::max(schedule.end_s, worker.free_s);
  }
  return schedule;
}

}  // namespace unimapper::bench
