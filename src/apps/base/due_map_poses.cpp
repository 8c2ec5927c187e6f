#include "src/apps/base/due_map_poses.hpp"

namespace unimapper::apps {

namespace {

constexpr std::chrono::seconds kRepeatInterval{1};

}  // namespace

void DueMapPoses::put(const wire::MapPoseMessage& message) {
  const std::lock_guard lock(mutex_);
  entries_[message.session] = {message, {}};
}

void DueMapPoses::forget(const SessionId& session) {
  const std::lock_guard lock(mutex_);
  entries_.erase(session);
}

std::vector<wire::MapPoseMessage> DueMapPoses::take(Clock::time_point now) {
  std::vector<wire::MapPoseMessage> due;
  const std::lock_guard lock(mutex_);
  for (auto& [session, entry] : entries_) {
    if (now < entry.due) continue;
    due.push_back(entry.message);
    entry.due = now + kRepeatInterval;
  }
  return due;
}

}  // namespace unimapper::apps
