// Events of a server, for clients that follow them.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

namespace unimapper::apps {

/// The latest events, each with a running number. A client that is slower than they come misses the
/// oldest of them. Thread safe.
class EventStream {
 public:
  /// `data`: JSON in one line.
  void publish(const std::string& event, const std::string& data);
  /// Server-sent events after number `seen`, which becomes that of the last one; empty after
  /// `most` without any. `missed`: events were lost to this client.
  std::string after(std::uint64_t& seen, std::chrono::milliseconds most, bool& missed);
  /// The number of the latest event.
  [[nodiscard]] std::uint64_t latest();
  /// Ends all waiting; nothing is waited for from then on.
  void close();
  [[nodiscard]] bool is_closed();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> kept_;
  std::uint64_t last_ = 0;  ///< number of the last of `kept_`
  bool closed_ = false;
};

}  // namespace unimapper::apps
