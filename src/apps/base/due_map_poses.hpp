// Map poses that robots are to be told, each when it changes and then once a second.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::apps {

/// A session is told where it was last for so long after its end.
inline constexpr std::chrono::seconds kToldAfterEnd{3};
/// A session is told where it was last for so long after its newest keyframe.
inline constexpr std::chrono::minutes kToldWithoutKeyframe{10};

/// Between the thread that localises and the one that sends: messages get lost, so the latest of
/// each session is said again and again. Thread safe.
class DueMapPoses {
 public:
  /// The clock of the times handed in.
  using Clock = std::chrono::steady_clock;

  /// From now on this is what the session is told.
  void put(const wire::MapPoseMessage& message);
  /// From now on the session is told nothing.
  void forget(const SessionId& session);
  /// What is new since it was taken last, and what was taken last a second ago. O(sessions).
  std::vector<wire::MapPoseMessage> take(Clock::time_point now);

 private:
  struct Entry {
    wire::MapPoseMessage message;
    Clock::time_point due;  ///< in the past: not taken yet
  };
  std::mutex mutex_;
  std::map<SessionId, Entry> entries_;
};

/// Options whose `answered` and `forgotten` tell `due`, which must outlive them.
template <typename Options>
Options telling(Options options, DueMapPoses& due) {
  options.answered = [&due](const wire::MapPoseMessage& message) { due.put(message); };
  options.forgotten = [&due](const SessionId& session) { due.forget(session); };
  return options;
}

}  // namespace unimapper::apps
