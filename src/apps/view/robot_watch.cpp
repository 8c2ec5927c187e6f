#include "src/apps/view/robot_watch.hpp"

#include <iterator>
#include <nlohmann/json.hpp>

#include "ports/store/store_file.hpp"
#include "src/apps/view/health_view.hpp"

namespace unimapper::apps {
namespace {

constexpr std::chrono::seconds kWatchPeriod{1};

}  // namespace

std::vector<AlarmChange> RobotWatch::look() {
  {
    const std::lock_guard lock(mutex_);
    if (Clock::now() < next_) return {};
    next_ = Clock::now() + kWatchPeriod;
  }
  if (!store::has_tables(store_)) return {};
  const std::int64_t now_s = std::chrono::duration_cast<std::chrono::seconds>(
                                 std::chrono::system_clock::now().time_since_epoch())
                                 .count();
  const auto history = store::read_health(store_, now_s - kAlarmedSeconds);
  std::vector<RobotAlarm> found;
  for (const store::SessionListing& session : store::StoreReader(store_).sessions()) {
    std::vector<RobotAlarm> own = alarms_of(session, history, now_s);
    found.insert(found.end(), std::make_move_iterator(own.begin()),
                 std::make_move_iterator(own.end()));
  }
  const std::lock_guard lock(mutex_);
  latency_ms_.clear();
  for (const store::HealthRow& row : history) {
    if (const auto latency = link_latency_ms(row)) latency_ms_[row.session] = *latency;
  }
  return list_.replace(std::move(found));
}

std::vector<RobotAlarm> RobotWatch::alarms() {
  const std::lock_guard lock(mutex_);
  return list_.present();
}

std::optional<double> RobotWatch::latency_ms(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  const auto found = latency_ms_.find(session);
  return found == latency_ms_.end() ? std::nullopt : std::optional(found->second);
}

nlohmann::ordered_json describe_alarm(const RobotAlarm& alarm) {
  return {
      {"name", alarm.name}, {"kind", alarm.kind}, {"text", alarm.text}, {"since_s", alarm.since_s}};
}

}  // namespace unimapper::apps
