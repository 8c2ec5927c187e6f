// Inspection of a host's real-time capabilities.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace unimapper::linux_port {

/// Meaning of a finding for a real-time robot.
enum class CheckStatus : std::uint8_t {
  kGood,     ///< sufficient
  kWarning,  ///< works, but deadlines may be missed
  kRefused   ///< needed, and not allowed here
};

/// "good", "warning" or "refused".
[[nodiscard]] const char* status_name(CheckStatus status) noexcept;

/// Result of one check.
struct Finding {
  std::string name;                         ///< e.g. "sched_fifo"
  std::string value;                        ///< for people
  CheckStatus status = CheckStatus::kGood;  ///< outcome of the check
  std::string advice;                       ///< a sentence; empty if good
};

/// Tries or reads, in this order: SCHED_FIFO at `priority`, pinning to `core`, mlockall,
/// PREEMPT_RT, real-time throttling, CPU governor, clock resolution, net.core.rmem_max,
/// transparent huge pages. Works on a thread of its own and leaves nothing changed.
[[nodiscard]] std::vector<Finding> inspect_host(int priority, int core);

/// Page faults of one block: while it was prefaulted, and when it was used afterwards.
struct PrefaultTrial {
  std::size_t bytes = 0;                      ///< size of the block
  std::int64_t faults_while_prefaulting = 0;  ///< page faults of the first access
  std::int64_t faults_afterwards = 0;         ///< 0 if prefaulting works
};

/// Prefaults `bytes` of fresh memory and uses them. Throws std::runtime_error if there are none.
[[nodiscard]] PrefaultTrial try_prefault(std::size_t bytes);

}  // namespace unimapper::linux_port
