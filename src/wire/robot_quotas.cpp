#include "unimapper/wire/robot_quotas.hpp"

#include <algorithm>

namespace unimapper::wire {

namespace {

/// A robot whose link was down sends what it kept.
constexpr double kBurstSeconds = 10.0;

}  // namespace

void RobotQuotas::load(const std::vector<RobotUsage>& usage) {
  for (const RobotUsage& one : usage) {
    Robot& robot = robots_[one.robot];
    robot.sessions += one.sessions;
    robot.bytes += one.bytes;
  }
}

double RobotQuotas::recent_bytes(const Robot& robot, std::int64_t now_ns) const {
  const double seconds = static_cast<double>(now_ns - robot.since_ns) * 1e-9;
  return std::max(0.0, robot.recent_bytes - seconds * limits_.bytes_per_second);
}

QuotaRefusal RobotQuotas::check(std::uint32_t robot, bool is_new_session, std::uint64_t bytes,
                                std::int64_t now_ns) const {
  const auto found = robots_.find(robot);
  const Robot usage = found == robots_.end() ? Robot() : found->second;
  if (is_new_session && usage.sessions >= limits_.sessions) return QuotaRefusal::kSessions;
  if (bytes > limits_.bytes - std::min(limits_.bytes, usage.bytes)) return QuotaRefusal::kBytes;
  const bool is_fast =
      usage.recent_bytes > 0.0 && recent_bytes(usage, now_ns) + static_cast<double>(bytes) >
                                      kBurstSeconds * limits_.bytes_per_second;
  return is_fast ? QuotaRefusal::kRate : QuotaRefusal::kNone;
}

void RobotQuotas::take(std::uint32_t robot, bool is_new_session, std::uint64_t bytes,
                       std::int64_t now_ns) {
  Robot& usage = robots_[robot];
  usage.sessions += is_new_session ? 1 : 0;
  usage.bytes += bytes;
  // An unlimited rate forgets at once; 0 times infinity is no number.
  const bool is_limited = limits_.bytes_per_second < std::numeric_limits<double>::infinity();
  usage.recent_bytes = is_limited ? recent_bytes(usage, now_ns) + static_cast<double>(bytes) : 0.0;
  usage.since_ns = now_ns;
}

void RobotQuotas::give_back(std::uint32_t robot, std::uint64_t bytes) {
  const auto found = robots_.find(robot);
  if (found != robots_.end()) found->second.bytes -= std::min(found->second.bytes, bytes);
}

}  // namespace unimapper::wire
