#include "src/apps/base/merge_thread.hpp"

#include <utility>

namespace unimapper::apps {

MergeThread::MergeThread(LiveMergeOptions options, const store::StoreLock& held)
    : merge_(telling(options, due_), held),
      thread_({[this] {
                 merge_.advance();
                 const std::lock_guard lock(guard_);
                 counters_ = merge_.counters();
                 return false;
               },
               "the map is merged again", "the map is not merged", std::move(options.report)}) {}

LiveMergeCounters MergeThread::counters() const {
  const std::lock_guard lock(guard_);
  return counters_;
}

LiveMergeCounters MergeThread::finish() {
  thread_.finish();
  merge_.finish();
  return merge_.counters();
}

}  // namespace unimapper::apps
