// Failures to write the files of a run folder.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

namespace unimapper::apps {

/// Counts files and parts of files that could not be written, so that a full disk ends neither
/// mapping nor delivery. Says in words when writing begins to fail and when it works again. For
/// several threads.
class WriteFailures {
 public:
  /// Calls `write`; what it throws as std::runtime_error is counted and reported. False if it did.
  bool attempt(const std::function<void()>& write);

  /// How many calls failed.
  [[nodiscard]] std::uint64_t count() const;

 private:
  mutable std::mutex mutex_;
  std::uint64_t count_ = 0;
  bool failing_ = false;
};

}  // namespace unimapper::apps
