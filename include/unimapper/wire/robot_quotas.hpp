// Quotas of single robots at the base.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <vector>

#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::wire {

/// What one robot may fill; without limits unless they are set.
struct RobotLimits {
  std::uint64_t sessions = std::numeric_limits<std::uint64_t>::max();  ///< stored
  std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();     ///< of its stored keyframes
  /// Of new keyframes, on average; ten seconds' worth may come at once.
  double bytes_per_second = std::numeric_limits<double>::infinity();
  std::uint32_t pending_keyframes = std::numeric_limits<std::uint32_t>::max();  ///< incomplete
  /// For incomplete keyframes.
  std::uint64_t pending_bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Why a keyframe is refused.
enum class QuotaRefusal : std::uint8_t {
  kNone,      ///< not refused
  kSessions,  ///< its robot has too many sessions
  kBytes,     ///< its robot has too much stored
  kRate,      ///< its robot sends too fast; later it may be taken
};

/// Counts what is stored of each robot, and says what is beyond its quota. Robots without a stored
/// keyframe take no memory.
class RobotQuotas {
 public:
  explicit RobotQuotas(const RobotLimits& limits) : limits_(limits) {}

  /// Counts what was stored earlier.
  void load(const std::vector<RobotUsage>& usage);
  /// Whether a keyframe of so many encoded bytes may be stored. `now_ns`: any steady clock.
  [[nodiscard]] QuotaRefusal check(std::uint32_t robot, bool is_new_session, std::uint64_t bytes,
                                   std::int64_t now_ns) const;
  /// Counts it, as stored at that time.
  void take(std::uint32_t robot, bool is_new_session, std::uint64_t bytes, std::int64_t now_ns);
  /// So many bytes that were counted are not stored any more.
  void give_back(std::uint32_t robot, std::uint64_t bytes);

 private:
  struct Robot {
    std::uint64_t sessions = 0;
    std::uint64_t bytes = 0;
    double recent_bytes = 0.0;  ///< less what the rate has let through since
    std::int64_t since_ns = 0;  ///< time of `recent_bytes`
  };

  [[nodiscard]] double recent_bytes(const Robot& robot, std::int64_t now_ns) const;

  RobotLimits limits_;
  std::map<std::uint32_t, Robot> robots_;
};

}  // namespace unimapper::wire
