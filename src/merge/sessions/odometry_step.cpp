#include "odometry_step.hpp"

#include <algorithm>
#include <cstdio>

namespace unimapper::merge {
namespace {

double seconds_between(const KeyframeScan& a, const KeyframeScan& b) {
  return static_cast<double>(b.stamp_ns - a.stamp_ns) * 1e-9;
}

double metres_between(const KeyframeScan& a, const KeyframeScan& b) {
  return (b.T_odometry_sensor.translation - a.T_odometry_sensor.translation).norm();
}

/// Within keyframes: a step of the odometry closes one. Empty if no keyframe tells, as with poses
/// that are held until the next one comes.
std::optional<double> fastest_mps(const SessionData& session) {
  std::optional<double> fastest;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    for (std::size_t i = 1; i < keyframe.scans.size(); ++i) {
      const double duration_s = seconds_between(keyframe.scans[i - 1], keyframe.scans[i]);
      if (duration_s <= 0.0) return std::nullopt;
      const double speed_mps =
          metres_between(keyframe.scans[i - 1], keyframe.scans[i]) / duration_s;
      fastest = std::max(fastest.value_or(0.0), speed_mps);
    }
  }
  return fastest == 0.0 ? std::nullopt : fastest;
}

}  // namespace

std::optional<OdometryStep> find_impossible_step(const SessionData& session) {
  constexpr double kLongestM = 3.0;
  constexpr double kTimesFaster = 1.5;
  constexpr double kSlowestMps = 3.0;
  const auto fastest = fastest_mps(session);
  if (!fastest) return std::nullopt;
  for (std::size_t k = 1; k < session.keyframes.size(); ++k) {
    const KeyframeScan& last = session.keyframes[k - 1].scans.back();
    const KeyframeScan& first = session.keyframes[k].scans.front();
    const OdometryStep step{k, metres_between(last, first), seconds_between(last, first)};
    if (step.duration_s <= 0.0) return std::nullopt;
    const double way_m = kTimesFaster * std::max(*fastest, kSlowestMps) * step.duration_s;
    if (step.length_m > kLongestM + way_m) return step;
  }
  return std::nullopt;
}

std::string reason_against_odometry(const SessionData& session) {
  const auto step = find_impossible_step(session);
  if (!step) return {};
  char text[256];
  std::snprintf(text, sizeof text,
                "its odometry steps by %.1f m in %.1f s before keyframe %u, which no robot does: "
                "where an odometry starts anew, a new session must begin",
                step->length_m, step->duration_s, session.keyframes[step->keyframe].sequence);
  return text;
}

}  // namespace unimapper::merge
