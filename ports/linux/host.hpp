// What this computer offers a thread that must keep time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace unimapper::linux_port {

/// What a finding means for a robot that must keep time.
enum class Verdict : std::uint8_t {
  kGood,     ///< as it should be
  kWarning,  ///< works, but deadlines may be missed
  kRefused   ///< needed, and not allowed here
};

/// "good", "warning" or "refused".
[[nodiscard]] const char* verdict_name(Verdict verdict) noexcept;

/// One thing that was looked at.
struct Finding {
  std::string name;   ///< e.g. "sched_fifo"
  std::string value;  ///< what was found, for people
  Verdict verdict = Verdict::kGood;
  std::string advice;  ///< a sentence; empty if good
};

/// Tries or reads, in this order: SCHED_FIFO at `priority`, pinning to `core`, mlockall,
/// PREEMPT_RT, real-time throttling, CPU governor, clock resolution, net.core.rmem_max,
/// transparent huge pages. Works on a thread of its own and leaves nothing changed.
[[nodiscard]] std::vector<Finding> inspect_host(int priority, int core);

/// Page faults of one block: while it was prefaulted, and when it was used afterwards.
struct PrefaultTrial {
  std::size_t bytes = 0;
  std::int64_t faults_while_prefaulting = 0;
  std::int64_t faults_afterwards = 0;  ///< 0 if prefaulting works
};

/// Prefaults `bytes` of fresh memory and uses them. Throws std::runtime_error if there are none.
[[nodiscard]] PrefaultTrial try_prefault(std::size_t bytes);

}  // namespace unimapper::linux_port
