// Second half of a merge, and the times of all its stages.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// Times the stages of a merge and tells them to whoever watches its progress.
class StageTimes {
 public:
  StageTimes(const std::function<void(const std::string&)>& progress,
             std::vector<StageTime>& timing)
      : progress_(progress), timing_(timing) {}

  void begin(const std::string& stage) {
    if (progress_) progress_(stage);
    started_ = Clock::now();
    stage_ = stage;
  }
  void end(const std::string& outcome = {}) {
    const std::chrono::duration<double> elapsed = Clock::now() - started_;
    timing_.push_back({stage_, elapsed.count()});
    if (progress_ && !outcome.empty()) progress_(outcome);
  }

 private:
  using Clock = std::chrono::steady_clock;

  const std::function<void(const std::string&)>& progress_;
  std::vector<StageTime>& timing_;
  Clock::time_point started_;
  std::string stage_;
};

/// Labels, map and changes of a merge whose poses and loops are known. Voxels and map are kept in a
/// file of the folder `scratch`, where it is given.
MergeResult finish_map(const std::vector<SessionData>& sessions, MergeResult posed,
                       const MergeConfig& config,
                       const std::function<void(const std::string&)>& progress,
                       const std::filesystem::path& scratch);

}  // namespace unimapper::merge
