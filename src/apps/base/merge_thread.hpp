// Thread of a base that merges what it stores, so that neither commits nor answers wait for it.
#pragma once

#include <mutex>
#include <vector>

#include "src/apps/base/due_map_poses.hpp"
#include "src/apps/base/live_merge.hpp"
#include "src/apps/base/repeated_work.hpp"

namespace unimapper::apps {

/// Looks for new keyframes five times a second. Whatever fails is told in words and tried again.
class MergeThread {
 public:
  /// `options.answered` and `options.forgotten` are its own; `options.report` is called from its
  /// thread. `held`: the store's lock, which must outlive it. Throws store::StoreError.
  MergeThread(LiveMergeOptions options, const store::StoreLock& held);

  /// What robots are to be told now. Takes a lock for a moment.
  std::vector<wire::MapPoseMessage> due() { return due_.take(DueMapPoses::Clock::now()); }
  /// Totals after the latest merge, from any thread.
  [[nodiscard]] LiveMergeCounters counters() const;
  /// Waits for the merge that goes on, ends the thread, merges what has arrived since, and says
  /// what became of merges. Throws std::exception if that last merge fails.
  LiveMergeCounters finish();

 private:
  DueMapPoses due_;
  LiveMerge merge_;  ///< the thread's own
  mutable std::mutex guard_;
  LiveMergeCounters counters_;
  RepeatedWork thread_;
};

}  // namespace unimapper::apps
