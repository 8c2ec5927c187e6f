// Watch over the robots of a store: alarms, latency, how much of what they made is stored.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "src/apps/view/robot_alarms.hpp"

namespace unimapper::apps {

/// Looks at a store's sessions and their health once a second. Thread safe.
class RobotWatch {
 public:
  explicit RobotWatch(std::filesystem::path store) : store_(std::move(store)) {}

  /// Looks, unless it did within the second; what changed of the alarms. O(sessions + rows of their
  /// health of the last hour). Throws store::StoreError.
  std::vector<AlarmChange> look();
  /// What is wrong at present.
  [[nodiscard]] std::vector<RobotAlarm> alarms();
  /// Half of the shortest round trip to the session's robot, as its latest message of the last hour
  /// says; none where it does not.
  [[nodiscard]] std::optional<double> latency_ms(std::int64_t session);

 private:
  using Clock = std::chrono::steady_clock;

  std::filesystem::path store_;
  std::mutex mutex_;  ///< of all that follows
  Clock::time_point next_{};
  AlarmList list_;
  std::map<std::int64_t, double> latency_ms_;  ///< by session
};

/// An alarm as events and `api/health` have it, without the number of its session.
[[nodiscard]] nlohmann::ordered_json describe_alarm(const RobotAlarm& alarm);

}  // namespace unimapper::apps
