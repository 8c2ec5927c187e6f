#include "ports/events/event_text.hpp"

#include <cstddef>
#include <cstdio>
#include <iterator>
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

std::string printed(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string mount(const EventRecord& record) {
  constexpr std::string_view kParts[] = {"roll", "pitch", "yaw", "x", "y", "z"};
  constexpr std::size_t kAngles = 3;
  const auto part = static_cast<std::size_t>(record.values[0]);
  if (part >= std::size(kParts)) return "unknown part";
  return std::string(kParts[part]) +
         printed(" by %.2f", 1e-3 * static_cast<double>(record.values[1])) +
         (part < kAngles ? " degrees" : " m") +
         printed(" (standard deviation %.2f)", 1e-3 * static_cast<double>(record.values[2]));
}

std::string clock(const EventRecord& record) {
  const double delay_s = 1e-3 * static_cast<double>(record.values[0]);
  return "the poses are " + printed("%.2f s ", delay_s < 0.0 ? -delay_s : delay_s) +
         (delay_s > 0.0 ? "late" : "early") + " against the scans" +
         printed(" (standard deviation %.3f s)", 1e-3 * static_cast<double>(record.values[1])) +
         ": give each scan the pose of its own stamp";
}

std::string scale(const EventRecord& record) {
  const double longer = 1.0 / (1.0 + 1e-3 * static_cast<double>(record.values[0]));
  return "the given motions are" + printed(" %.2f times as long as the scans show", longer) +
         printed(" (standard deviation %.3f)", 1e-3 * static_cast<double>(record.values[1]));
}

std::string motion(const EventRecord& record) {
  std::string text = "the scans move otherwise than the poses say";
  const std::string_view remedy = remedy_of_mistake(record.values[0]);
  if (!remedy.empty()) return text + ": " + std::string(remedy);
  return text +
         printed(", the given motions %.2f times as long",
                 1e-3 * static_cast<double>(record.values[1])) +
         ": check that each scan has the pose of its own stamp, and that scans and poses are in "
         "the same order, units and axes";
}

std::string what_happened(const EventRecord& record) {
  const auto number = [&record](std::size_t i) { return std::to_string(record.values[i]); };
  const auto degrees = [&record](std::size_t i) {
    return printed("%.2f deg", 1e-3 * static_cast<double>(record.values[i]));
  };
  const auto percent = [&record](std::size_t i) {
    return printed("%.1f %%", 0.1 * static_cast<double>(record.values[i]));
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
    case EventId::kMountContradicted:
      return "keyframe " + number(3) +
             ": the scans move as if the LiDAR were mounted otherwise than the poses say, " +
             mount(record);
    case EventId::kClockContradicted:
      return "keyframe " + number(2) + ": " + clock(record);
    case EventId::kScaleContradicted:
      return "keyframe " + number(2) + ": " + scale(record);
    case EventId::kMotionContradicted:
      return "keyframe " + number(2) + ": " + motion(record);
  }
  return "event " + std::to_string(record.id) + ": " + number(0) + " " + number(1) + " " +
         number(2) + " " + number(3);
}

}  // namespace

std::string_view remedy_of_mistake(std::int64_t mistake) {
  constexpr std::string_view kRemedies[] = {
      "",
      "the poses look like T_sensor_world; invert them (T_world_sensor is needed)",
      "the quaternions look like qw qx qy qz; write them as qx qy qz qw (w last), as TUM does",
      "the quaternions look like qx qy qz qw where w is expected first; write them as qw qx qy qz",
      "the poses look like those of a camera (x right, y down, z forward); transform them to the "
      "LiDAR, or in the KITTI layout add calib.txt with a line Tr:",
      "the poses look like x forward, y right, z down (NED), the points like z up; convert one of "
      "them, or give --extrinsic 0,0,0,180,0,0",
      "poses and points differ in handedness, mirrored along y (to the right in one, to the left "
      "in the other); negate y in one of them",
      "poses and points differ in handedness, mirrored along x (ahead in one, behind in the "
      "other); negate x in one of them",
      "poses and points differ in handedness, mirrored along z (up in one, down in the other); "
      "negate z in one of them",
      "the poses look like those of a body whose x axis points backwards in the points' frame; "
      "multiply them by the extrinsic T_body_lidar",
      "the poses look like those of a body turned by 90 degrees against the points; multiply them "
      "by the extrinsic T_body_lidar",
      "the poses look like those of a body turned by -90 degrees against the points; multiply "
      "them by the extrinsic T_body_lidar",
      "the rotations look transposed (stored by columns); write the 3x4 matrices row by row",
      "the poses' positions look like millimetres; multiply them by 0.001",
      "the poses' positions look like centimetres; multiply them by 0.01",
      "the poses' positions look like kilometres; multiply them by 1000",
      "the poses' positions look like feet; multiply them by 0.3048",
      "the poses' positions look like decimetres; multiply them by 0.1",
      "the poses' positions look like hundreds of metres; multiply them by 100",
      "the poses' positions look like tens of metres; multiply them by 10",
      "the poses' positions look like metres, and the points like feet; multiply them by 3.28084",
  };
  return mistake >= 0 && static_cast<std::size_t>(mistake) < std::size(kRemedies)
             ? kRemedies[mistake]
             : std::string_view();
}

bool is_contradiction(const EventRecord& record) {
  switch (static_cast<EventId>(record.id)) {
    case EventId::kOdometryContradicted:
    case EventId::kMountContradicted:
    case EventId::kClockContradicted:
    case EventId::kScaleContradicted:
    case EventId::kMotionContradicted:
      return true;
    default:
      return false;
  }
}

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
