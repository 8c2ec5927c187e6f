// Alarms of robots: what is wrong with a session, in words.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ports/store/health_reader.hpp"
#include "ports/store/store_reader.hpp"

namespace unimapper::apps {

/// A robot that was heard longer ago than that is history: it has alarms no more, but for keyframes
/// that are missing.
inline constexpr std::int64_t kAlarmedSeconds = 3600;

/// Something that is wrong with a session now.
struct RobotAlarm {
  std::int64_t session = 0;  ///< row of its session in the store
  std::string name;          ///< of the session
  std::string kind;          ///< as docs/api.md lists them; one of a kind at a time
  std::string text;          ///< what is wrong
  std::int64_t since_s = 0;  ///< Unix time since when, as far as it is known
};

/// What is wrong with the session at `now_s` (Unix time); the rules are in docs/api.md. `history`:
/// of all sessions, by session, then time. O(rows).
[[nodiscard]] std::vector<RobotAlarm> alarms_of(const store::SessionListing& session,
                                                const std::vector<store::HealthRow>& history,
                                                std::int64_t now_s);

/// An alarm that is new or says something new, or is over.
struct AlarmChange {
  RobotAlarm alarm;
  bool is_over = false;
};

/// Alarms as they come and go. Not thread safe.
class AlarmList {
 public:
  /// Takes the place of all that was there before; what differs. One that stays keeps its time.
  std::vector<AlarmChange> replace(std::vector<RobotAlarm> alarms);
  /// What is wrong at present.
  [[nodiscard]] const std::vector<RobotAlarm>& present() const { return present_; }

 private:
  std::vector<RobotAlarm> present_;
};

}  // namespace unimapper::apps
