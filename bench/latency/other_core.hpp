// What the other core does while this one is measured.
#pragma once

#include <atomic>
#include <thread>

namespace unimapper::bench {

/// Keeps the calling thread on the last processor it may use; while it lives and `loaded`, a
/// thread on the first one streams through memory as fast as it can.
class OtherCore {
 public:
  explicit OtherCore(bool loaded);
  ~OtherCore();
  OtherCore(const OtherCore&) = delete;
  OtherCore& operator=(const OtherCore&) = delete;

 private:
  std::atomic<bool> stop_{false};
  std::thread busy_;
};

}  // namespace unimapper::bench
