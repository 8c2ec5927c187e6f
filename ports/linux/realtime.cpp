#include "ports/linux/realtime.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>

namespace unimapper::linux_port {

Outcome lock_memory() noexcept {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  switch (errno) {
    case EPERM:
      return {false, EPERM,
              "this process may not lock memory: give it CAP_IPC_LOCK or raise RLIMIT_MEMLOCK "
              "(ulimit -l)"};
    case ENOMEM:
    case EAGAIN:
      return {false, errno,
              "the process is larger than RLIMIT_MEMLOCK allows to lock: raise it (ulimit -l "
              "unlimited, or memlock in /etc/security/limits.conf)"};
    default:
      return {false, errno, "this kernel does not lock memory"};
  }
}

void unlock_memory() noexcept { munlockall(); }

Outcome prefault(std::span<std::byte> memory) noexcept {
  if (memory.empty()) return {false, EINVAL, "there is no memory to touch: the span is empty"};
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const auto touch = [&memory](std::size_t at) {
    volatile std::byte& byte = memory[at];
    byte = byte;
  };
  // Steps of one page from the block's begin touch every page but perhaps the last.
  for (std::size_t at = 0; at < memory.size(); at += page) touch(at);
  touch(memory.size() - 1);
  return {};
}

Outcome set_realtime_priority(int priority) noexcept {
  if (priority < sched_get_priority_min(SCHED_FIFO) ||
      priority > sched_get_priority_max(SCHED_FIFO)) {
    return {false, EINVAL, "the priority must be 1 to 99"};
  }
  sched_param parameter{};
  parameter.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter);
  if (error == 0) return {};
  if (error == EPERM) {
    return {false, EPERM,
            "this process may not use SCHED_FIFO with this priority: give it CAP_SYS_NICE or "
            "raise RLIMIT_RTPRIO (rtprio in /etc/security/limits.conf)"};
  }
  return {false, error, "this kernel does not offer SCHED_FIFO"};
}

Outcome pin_to_core(int core) noexcept {
  if (core < 0 || core >= CPU_SETSIZE) {
    return {false, EINVAL, "the core must be 0 to 1023"};
  }
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(static_cast<unsigned>(core), &cores);
  const int error = pthread_setaffinity_np(pthread_self(), sizeof cores, &cores);
  if (error == 0) return {};
  if (error == EINVAL) {
    return {false, EINVAL,
            "this process has no such core: the computer has fewer, or a cpuset (container, "
            "taskset) keeps it out"};
  }
  return {false, error, "this process may not choose its cores"};
}

std::int64_t page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return std::int64_t{usage.ru_minflt} + std::int64_t{usage.ru_majflt};
}

}  // namespace unimapper::linux_port
