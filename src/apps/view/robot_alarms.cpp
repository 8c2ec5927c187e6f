#include "src/apps/view/robot_alarms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "src/apps/view/health_view.hpp"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::apps {
namespace {

/// Health comes every second, over a thin link (docs/wire-format.md) less often.
constexpr std::int64_t kSilenceSeconds = 30;
/// What was made so long ago has had its time to arrive.
constexpr std::int64_t kArrivalSeconds = 60;
constexpr double kNearlyFull = 0.9;

/// Points that are none or are out of range are the sensor's, and of a place a sample is enough.
constexpr std::array kHarmlessCauses = {DropCause::kNotFinite, DropCause::kOutOfRange,
                                        DropCause::kDescriptionFull};

bool is_harmless(std::string_view cause) {
  return std::any_of(kHarmlessCauses.begin(), kHarmlessCauses.end(),
                     [&](DropCause one) { return drop_cause_name(one) == cause; });
}

/// The figure of that entry of a message; 0 where it has none.
double figure(const store::HealthRow* row, std::string_view kind, std::string_view name,
              std::size_t index) {
  if (row == nullptr) return 0.0;
  for (const store::HealthDetail& detail : row->details) {
    // A clock's name is its offset.
    if (detail.kind != kind || (kind != "clock" && detail.name != name)) continue;
    if (index < detail.figures.size()) return detail.figures[index];
  }
  return 0.0;
}

/// A session's alarms at one time, from its latest message and that of the minute before.
class AlarmFinder {
 public:
  AlarmFinder(const store::SessionListing& session, const std::vector<store::HealthRow>& history,
              std::int64_t now_s)
      : session_(session), now_s_(now_s) {
    for (const store::HealthRow& row : history) {
      if (row.session != session.row) continue;
      before_ = latest_;
      latest_ = &row;
      if (row.received_s + kArrivalSeconds <= now_s) earlier_ = &row;
    }
  }

  std::vector<RobotAlarm> find() {
    const bool is_live =
        !session_.ended && latest_ != nullptr && now_s_ - latest_->received_s <= kAlarmedSeconds;
    if (is_live) {
      look_for_silence();
      look_for_deadlines();
      for (const store::HealthDetail& detail : latest_->details) look_at(detail);
    }
    look_for_missing(is_live);
    return std::move(alarms_);
  }

 private:
  void raise(const std::string& kind, const std::string& text, std::int64_t since_s) {
    alarms_.push_back({session_.row, session_.info.name, kind, text, since_s});
  }

  void look_for_silence() {
    if (now_s_ - latest_->received_s <= kSilenceSeconds) return;
    raise("silence", "sends nothing, and its session has not ended", latest_->received_s);
  }

  void look_for_deadlines() {
    const std::int64_t misses =
        latest_->deadline_misses - (before_ == nullptr ? 0 : before_->deadline_misses);
    if (misses <= 0) return;
    raise("deadline", "missed its deadline " + std::to_string(misses) + " times within a minute",
          now_s_);
  }

  void look_at(const store::HealthDetail& detail) {
    if (detail.kind == "drop") look_for_drops(detail);
    if (detail.kind == "container") look_for_full(detail);
    if (detail.kind == "clock") look_for_clock(detail);
  }

  void look_for_drops(const store::HealthDetail& drop) {
    if (is_harmless(drop.name)) return;
    const double rise =
        figure(latest_, "drop", drop.name, 0) - figure(before_, "drop", drop.name, 0);
    if (rise <= 0.0) return;
    raise("dropped " + drop.name,
          "dropped " + std::to_string(std::llround(rise)) + " within a minute: " + drop.name,
          now_s_);
  }

  void look_for_full(const store::HealthDetail& container) {
    const std::vector<double>& figures = container.figures;
    if (figures.size() < 2 || figures[1] <= 0.0 || figures[0] < kNearlyFull * figures[1]) return;
    raise("full " + container.name,
          container.name + " is " + std::to_string(std::lround(100.0 * figures[0] / figures[1])) +
              " % full",
          now_s_);
  }

  /// A base tells an offset once, and again when either clock was set (docs/base.md).
  void look_for_clock(const store::HealthDetail& clock) {
    if (before_ == nullptr || figure(latest_, "clock", "", 1) <= figure(before_, "clock", "", 1)) {
      return;
    }
    const std::string text =
        fmt::format("a clock was set: the base's is ahead of the robot's by {:.1f} ms now",
                    clock_offset_ms(clock));
    raise("clock", text, now_s_);
  }

  void look_for_missing(bool is_live) {
    if (session_.ended && session_.missing() > 0) {
      raise("missing",
            std::to_string(session_.missing()) + " of " + std::to_string(session_.announced) +
                " keyframes are missing, and its session has ended",
            now_s_);
    }
    if (!is_live || earlier_ == nullptr) return;
    const auto stored = static_cast<std::int64_t>(session_.keyframes);
    if (earlier_->keyframes <= stored) return;
    raise("missing",
          std::to_string(earlier_->keyframes - stored) +
              " keyframes have not arrived within a minute",
          now_s_);
  }

  const store::SessionListing& session_;
  std::int64_t now_s_;
  const store::HealthRow* latest_ = nullptr;
  const store::HealthRow* before_ = nullptr;   ///< of the minute before the latest one
  const store::HealthRow* earlier_ = nullptr;  ///< the latest that is `kArrivalSeconds` old
  std::vector<RobotAlarm> alarms_;
};

bool is_of_same(const RobotAlarm& a, const RobotAlarm& b) {
  return a.session == b.session && a.kind == b.kind;
}

}  // namespace

std::vector<RobotAlarm> alarms_of(const store::SessionListing& session,
                                  const std::vector<store::HealthRow>& history,
                                  std::int64_t now_s) {
  return AlarmFinder(session, history, now_s).find();
}

std::vector<AlarmChange> AlarmList::replace(std::vector<RobotAlarm> alarms) {
  std::vector<AlarmChange> changes;
  for (RobotAlarm& alarm : alarms) {
    const auto same = std::find_if(present_.begin(), present_.end(),
                                   [&](const RobotAlarm& old) { return is_of_same(old, alarm); });
    if (same != present_.end()) alarm.since_s = std::min(alarm.since_s, same->since_s);
    if (same == present_.end() || same->text != alarm.text) changes.push_back({alarm, false});
  }
  for (const RobotAlarm& old : present_) {
    const bool stays = std::any_of(alarms.begin(), alarms.end(),
                                   [&](const RobotAlarm& alarm) { return is_of_same(old, alarm); });
    if (!stays) changes.push_back({old, true});
  }
  present_ = std::move(alarms);
  return changes;
}

}  // namespace unimapper::apps
