// Worker that verifies the loops of jobs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "loop_job.hpp"

namespace unimapper::merge {

/// Reads a keyframe, whole, by its name. Called from several threads at once; throws where it
/// cannot.
using ReadNamedKeyframe = std::function<KeyframeRecord(const std::string& name)>;

/// Verifies the loops of jobs as the merge would that made them, to the bit. Keyframes and
/// registration clouds of the latest merge are kept for its further jobs. Not thread safe.
class LoopWorker {
 public:
  /// `max_bytes`: of keyframes and clouds that are kept. `threads`: as in `MergeConfig`.
  LoopWorker(ReadNamedKeyframe read, std::uint64_t max_bytes, std::uint32_t threads);
  ~LoopWorker();
  LoopWorker(const LoopWorker&) = delete;
  LoopWorker& operator=(const LoopWorker&) = delete;

  /// One outcome for each question, in their order. `progress` is called every few loops. Throws
  /// std::runtime_error with the reason where a keyframe cannot be read or is not what the merge
  /// had.
  std::vector<LoopConstraint> answer(const LoopJob& job,
                                     const std::function<void()>& progress = {});

 private:
  class OfMerge;
  ReadNamedKeyframe read_;
  std::uint64_t max_bytes_;
  std::uint32_t threads_;
  std::unique_ptr<OfMerge> merge_;
};

}  // namespace unimapper::merge
