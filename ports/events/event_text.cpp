#include "ports/events/event_text.hpp"

#include <cstddef>
#include <cstdio>
#include <string_view>

#include "unimapper/core/expected.hpp"
#include "unimapper/onboard/events.hpp"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::events {

namespace {

std::string_view refusal(std::int64_t code) {
  switch (static_cast<ErrorCode>(code)) {
    case ErrorCode::kInvalidPose:
      return "invalid pose";
    case ErrorCode::kTimeReversed:
      return "stamp not later than the one before";
    case ErrorCode::kEmptyScan:
      return "no valid point";
    case ErrorCode::kTimeJump:
      return "the stamp lies far ahead, or the clock was set back";
    default:
      return "refused";
  }
}

template <typename Enum>
std::string name(std::string_view (*name_of)(Enum) noexcept, std::size_t count,
                 std::int64_t value) {
  const bool known = value >= 0 && static_cast<std::size_t>(value) < count;
  return known ? std::string(name_of(static_cast<Enum>(value))) : std::to_string(value);
}

std::string what_happened(const EventRecord& record) {
  const auto number = [&record](std::size_t i) { return std::to_string(record.values[i]); };
  const auto degrees = [&record](std::size_t i) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f deg", 1e-3 * static_cast<double>(record.values[i]));
    return std::string(text);
  };
  const auto percent = [&](std::size_t i) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f %%", 0.1 * static_cast<double>(record.values[i]));
    return std::string(text);
  };
  switch (static_cast<EventId>(record.id)) {
    case EventId::kKeyframeClosed:
      return "keyframe " + number(0) + " closed: " + number(1) + " scans, " + number(2) +
             " static cells, " + number(3) + " dynamic cells";
    case EventId::kScanRefused:
      return "scan " + number(1) + " refused: " + std::string(refusal(record.values[0]));
    case EventId::kPoseJump:
      return "scan " + number(0) + " refused: the pose jumped";
    case EventId::kDropped:
      return "keyframe " + number(2) + ": " + number(1) + " dropped, " +
             name(&drop_cause_name, kDropCauses, record.values[0]);
    case EventId::kDeadlineMissed:
      return "keyframe " + number(2) + ": deadline missed, " + number(0) + " us of " + number(1);
    case EventId::kUpContradicted:
      return "keyframe " + number(2) + ": the odometry's z axis is " + degrees(0) +
             " from up, beyond three sigma of the promised " + degrees(1);
    case EventId::kSamplingDiffers:
      return "rays " + degrees(0) + " apart on a ring, rings " + degrees(1) + ", configured " +
             degrees(2) + " and " + degrees(3);
    case EventId::kElevationsDiffer:
      return "range images from " + degrees(0) + " to " + degrees(1) + ", configured " +
             degrees(2) + " to " + degrees(3);
    case EventId::kAttitudeNoise:
      return "keyframe " + number(2) + ": attitude noise " + degrees(0) + ", " + number(1) +
             " scans aligned";
    case EventId::kSweepsUncompensated:
      return "keyframe " + number(2) + ": sweeps look uncompensated, scans tilt by " + degrees(0) +
             ", " + number(1) + " scans aligned";
    case EventId::kOdometryContradicted:
      if (record.values[0] == 0) {
        return "keyframe " + number(2) +
               ": the robot was shut in, as in a lift, and the odometry did not rise";
      }
      return "keyframe " + number(2) + ": the scans contradict the odometry, " + percent(0) +
             " of the cells are dynamic, usually " + percent(1);
  }
  return "event " + std::to_string(record.id) + ": " + number(0) + " " + number(1) + " " +
         number(2) + " " + number(3);
}

}  // namespace

std::string to_text(const EventRecord& record) {
  constexpr std::int64_t kSecond = 1000000000;
  const std::int64_t seconds = record.stamp_ns / kSecond;
  const std::int64_t rest = record.stamp_ns % kSecond;
  char stamp[40];
  std::snprintf(stamp, sizeof stamp, "%s%lld.%09lld ", record.stamp_ns < 0 ? "-" : "",
                static_cast<long long>(seconds < 0 ? -seconds : seconds),
                static_cast<long long>(rest < 0 ? -rest : rest));
  return stamp + what_happened(record);
}

}  // namespace unimapper::events
