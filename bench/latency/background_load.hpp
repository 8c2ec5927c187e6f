// Memory load on another core during a measurement.
#pragma once

#include <atomic>
#include <thread>

namespace unimapper::bench {

/// Keeps the calling thread on the last processor it may use; while it lives and `loaded`, a
/// thread on the first one streams through memory as fast as it can.
class BackgroundLoad {
 public:
  explicit BackgroundLoad(bool loaded);
  ~BackgroundLoad();
  BackgroundLoad(const BackgroundLoad&) = delete;
  BackgroundLoad& operator=(const BackgroundLoad&) = delete;

 private:
  std::atomic<bool> stop_{false};
  std::thread busy_;
};

}  // namespace unimapper::bench
