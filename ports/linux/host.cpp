#include "ports/linux/host.hpp"

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/utsname.h>

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <span>
#include <stdexcept>
#include <thread>

#include "ports/linux/realtime.hpp"

namespace unimapper::linux_port {

namespace {

/// The first line of a file; empty if it cannot be read.
std::string first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

Finding from_outcome(std::string name, std::string value, const Outcome& outcome) {
  return {std::move(name), outcome.ok ? std::move(value) : "not allowed",
          outcome.ok ? CheckStatus::kGood : CheckStatus::kRefused, outcome.message};
}

/// Scheduling is a property of the thread, so it is tried on a temporary one.
template <typename Attempt>
Outcome on_own_thread(Attempt attempt) {
  Outcome outcome;
  std::thread([&] { outcome = attempt(); }).join();
  return outcome;
}

Finding fifo(int priority) {
  return from_outcome("sched_fifo", "priority " + std::to_string(priority) + " granted",
                      on_own_thread([&] { return set_realtime_priority(priority); }));
}

Finding affinity(int core) {
  return from_outcome("affinity", "core " + std::to_string(core) + " granted",
                      on_own_thread([&] { return pin_to_core(core); }));
}

Finding memory_lock() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const std::string allowed =
      limit.rlim_cur == RLIM_INFINITY ? "unlimited" : std::to_string(limit.rlim_cur / 1024) + " kB";
  const Outcome outcome = lock_memory();
  if (outcome.ok) unlock_memory();
  Finding finding = from_outcome("mlockall", "granted, limit " + allowed, outcome);
  if (!outcome.ok) finding.value = "not allowed, limit " + allowed;
  return finding;
}

Finding preempt_rt() {
  utsname system{};
  uname(&system);
  const bool rt = first_line("/sys/kernel/realtime") == "1" ||
                  std::string(system.version).find("PREEMPT_RT") != std::string::npos;
  return {"preempt_rt", std::string(rt ? "yes" : "no") + ", kernel " + system.release,
          rt ? CheckStatus::kGood : CheckStatus::kWarning,
          rt ? ""
             : "wake-ups may take milliseconds on a loaded computer: install a PREEMPT_RT "
               "kernel if deadlines are hard"};
}

Finding throttling() {
  const std::string runtime = first_line("/proc/sys/kernel/sched_rt_runtime_us");
  if (runtime.empty()) return {"rt_throttling", "unknown", CheckStatus::kGood, ""};
  if (runtime == "-1") return {"rt_throttling", "off", CheckStatus::kGood, ""};
  return {"rt_throttling", runtime + " us of every second (sched_rt_runtime_us)",
          CheckStatus::kGood, ""};
}

Finding governor(int core) {
  const std::string name = first_line("/sys/devices/system/cpu/cpu" + std::to_string(core) +
                                      "/cpufreq/scaling_governor");
  if (name.empty()) return {"cpu_governor", "not readable", CheckStatus::kGood, ""};
  const bool steady = name == "performance";
  return {"cpu_governor", name, steady ? CheckStatus::kGood : CheckStatus::kWarning,
          steady ? ""
                 : "the clock rate follows the load: choose the governor \"performance\" "
                   "(cpupower frequency-set -g performance)"};
}

Finding clock_resolution() {
  timespec resolution{};
  clock_getres(CLOCK_MONOTONIC, &resolution);
  const std::string source =
      first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  const bool fine = resolution.tv_sec == 0 && resolution.tv_nsec <= 1000;
  return {"clock",
          std::to_string(resolution.tv_nsec) + " ns" + (source.empty() ? "" : ", source " + source),
          fine ? CheckStatus::kGood : CheckStatus::kWarning,
          fine ? "" : "the kernel has no high-resolution timers: periods are rounded to its tick"};
}

Finding receive_buffer() {
  constexpr long kWanted = 4194304;  // what the base's subscriber asks for
  const std::string text = first_line("/proc/sys/net/core/rmem_max");
  if (text.empty()) return {"rmem_max", "not readable", CheckStatus::kGood, ""};
  const bool enough = std::strtol(text.c_str(), nullptr, 10) >= kWanted;
  return {"rmem_max", text + " bytes", enough ? CheckStatus::kGood : CheckStatus::kWarning,
          enough ? ""
                 : "LCM receivers on this computer lose bursts: sysctl -w "
                   "net.core.rmem_max=4194304"};
}

Finding huge_pages() {
  const std::string modes = first_line("/sys/kernel/mm/transparent_hugepage/enabled");
  const std::size_t begin = modes.find('[');
  const std::size_t end = modes.find(']');
  if (begin == std::string::npos || end == std::string::npos) {
    return {"transparent_huge_pages", "not readable", CheckStatus::kGood, ""};
  }
  const std::string mode = modes.substr(begin + 1, end - begin - 1);
  const bool always = mode == "always";
  return {"transparent_huge_pages", mode, always ? CheckStatus::kWarning : CheckStatus::kGood,
          always ? "the kernel may move pages together at any time: choose \"madvise\"" : ""};
}

/// Anonymous pages that were never accessed.
class FreshMemory {
 public:
  explicit FreshMemory(std::size_t bytes)
      : bytes_(bytes),
        base_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {
    if (base_ == MAP_FAILED) throw std::runtime_error("no memory for the prefault check");
    // One fault per page, not per huge page, so that the count is comparable.
    madvise(base_, bytes_, MADV_NOHUGEPAGE);
  }
  ~FreshMemory() { munmap(base_, bytes_); }
  FreshMemory(const FreshMemory&) = delete;
  FreshMemory& operator=(const FreshMemory&) = delete;
  [[nodiscard]] std::span<std::byte> span() const {
    return {static_cast<std::byte*>(base_), bytes_};
  }

 private:
  std::size_t bytes_;
  void* base_;
};

}  // namespace

const char* status_name(CheckStatus status) noexcept {
  switch (status) {
    case CheckStatus::kGood:
      return "good";
    case CheckStatus::kWarning:
      return "warning";
    case CheckStatus::kRefused:
      return "refused";
  }
  return "unknown";
}

std::vector<Finding> inspect_host(int priority, int core) {
  return {fifo(priority), affinity(core),     memory_lock(),    preempt_rt(), throttling(),
          governor(core), clock_resolution(), receive_buffer(), huge_pages()};
}

PrefaultTrial try_prefault(std::size_t bytes) {
  const FreshMemory memory(bytes);
  PrefaultTrial trial{bytes, 0, 0};
  const std::int64_t before = page_faults();
  const Outcome outcome = prefault(memory.span());
  if (!outcome.ok) throw std::runtime_error(outcome.message);
  const std::int64_t between = page_faults();
  for (std::size_t i = 0; i < bytes; i += 64) {
    const_cast<volatile std::byte&>(memory.span()[i]) = std::byte{1};
  }
  trial.faults_while_prefaulting = between - before;
  trial.faults_afterwards = page_faults() - between;
  return trial;
}

}  // namespace unimapper::linux_port
