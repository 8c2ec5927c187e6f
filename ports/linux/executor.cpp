#include "ports/linux/executor.hpp"

#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstddef>

namespace unimapper::linux_port {
namespace {

using Word = std::atomic<std::uint32_t>;
static_assert(sizeof(Word) == 4 && Word::is_always_lock_free);

constexpr std::uint32_t kStop = UINT32_MAX;
constexpr std::uint32_t kCallerSleeps = 1U << 31U;

// About as long as it takes to wake a thread: spinning costs no more than it may save.
constexpr std::chrono::microseconds kSpin(50);

// The pipeline needs 64 kB; locked memory holds the whole stack.
constexpr std::size_t kUsedStackBytes = std::size_t{64} << 10U;
constexpr std::size_t kStackBytes = 4 * kUsedStackBytes;

void wait_while(const Word& word, std::uint32_t value) noexcept {
  (void)syscall(SYS_futex, &word, FUTEX_WAIT_PRIVATE, value, nullptr, nullptr, 0);
}

void wake(const Word& word, std::uint32_t count) noexcept {
  (void)syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, count, nullptr, nullptr, 0);
}

void pause() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__) || defined(__arm__)
  asm volatile("yield");
#endif
}

/// Its pages are there before the first part.
[[gnu::noinline]] void prefault_stack() noexcept {
  volatile std::byte stack[kUsedStackBytes];
  for (std::size_t i = 0; i < sizeof stack; i += 1024) stack[i] = std::byte{0};
}

/// What pthread_create was asked for, in words.
Outcome refusal(int error) noexcept {
  switch (error) {
    case EINVAL:
      return {false, error,
              "this process has no such core for a worker: the computer has fewer, or a cpuset "
              "(container, taskset) keeps it out"};
    case EPERM:
      return {false, error,
              "workers may not have the calling thread's priority, which it does not hand on: give "
              "the process CAP_SYS_NICE or raise RLIMIT_RTPRIO"};
    default:
      return {false, error,
              "the system has no room for another thread: raise RLIMIT_NPROC (ulimit -u) or the "
              "limit of the container"};
  }
}

/// How a thread is to be started: stack, and scheduling of the calling thread.
class Attributes {
 public:
  Attributes() noexcept {
    pthread_attr_init(&attributes_);
    pthread_attr_setstacksize(&attributes_, kStackBytes);
    // All else is inherited, but a thread with this flag does not hand on its real-time policy.
    const int policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
    if (policy != SCHED_FIFO && policy != SCHED_RR) return;
    sched_param parameter{};
    sched_getparam(0, &parameter);
    pthread_attr_setinheritsched(&attributes_, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes_, policy);
    pthread_attr_setschedparam(&attributes_, &parameter);
  }
  ~Attributes() { pthread_attr_destroy(&attributes_); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;

  void set_cores(const cpu_set_t& cores) noexcept {
    pthread_attr_setaffinity_np(&attributes_, sizeof cores, &cores);
  }
  [[nodiscard]] const pthread_attr_t* get() const noexcept { return &attributes_; }

 private:
  pthread_attr_t attributes_;
};

constexpr auto kAnywhere = [] {
  std::array<int, Executor::kMaxWorkers> cores{};
  cores.fill(WorkerThreads::kAnyCore);
  return cores;
}();

/// The cores that a thread on `core` may use, given those of the calling thread.
cpu_set_t allowed(int core, const cpu_set_t& own) noexcept {
  if (core == WorkerThreads::kAnyCore) return own;
  cpu_set_t one;
  CPU_ZERO(&one);
  if (core >= 0 && core < CPU_SETSIZE) CPU_SET(static_cast<unsigned>(core), &one);
  return one;
}

}  // namespace

WorkerThreads::WorkerThreads(std::span<const int> cores) noexcept {
  outcome_ = start(cores);
  if (!outcome_.ok) stop();
}

WorkerThreads::WorkerThreads(std::uint32_t workers) noexcept
    : WorkerThreads(std::span(kAnywhere).first(std::clamp<std::size_t>(workers, 1, 9) - 1)) {}

Outcome WorkerThreads::start(std::span<const int> cores) noexcept {
  if (cores.size() > handles_.size()) {
    return {false, EINVAL, "workers must be 1 to 8, the calling thread among them"};
  }
  cpu_set_t own;
  CPU_ZERO(&own);
  sched_getaffinity(0, sizeof own, &own);
  cpu_set_t all = own;
  for (const int core : cores) {
    if (core == kAnyCore && CPU_COUNT(&own) == 1) {
      return {false, EINVAL,
              "workers would share the calling thread's only core: name theirs, or create them "
              "before pin_to_core(), and after set_realtime_priority()"};
    }
    const cpu_set_t its = allowed(core, own);
    CPU_OR(&all, &all, &its);
  }
  spins_ = static_cast<std::size_t>(CPU_COUNT(&all)) > cores.size();
  Attributes attributes;
  for (const int core : cores) {
    attributes.set_cores(allowed(core, own));
    const auto entry = [](void* self) -> void* {
      static_cast<WorkerThreads*>(self)->work();
      return nullptr;
    };
    const int error = pthread_create(&handles_[threads_], attributes.get(), entry, this);
    if (error != 0) return refusal(error);
    pthread_setname_np(handles_[threads_++], "um-worker");
  }
  return {};
}

void WorkerThreads::stop() noexcept {
  left_.store(kStop);
  wake(left_, INT_MAX);
  for (; threads_ > 0; --threads_) pthread_join(handles_[threads_ - 1], nullptr);
}

Executor WorkerThreads::executor() noexcept {
  const auto run = [](void* self, std::uint32_t parts, Executor::Part part, void* task) {
    static_cast<WorkerThreads*>(self)->run(parts, part, task);
  };
  return {run, this, threads_ + 1};
}

template <typename Condition>
bool WorkerThreads::spin_until(Condition condition) const noexcept {
  if (!spins_) return condition();
  const auto end = std::chrono::steady_clock::now() + kSpin;
  do {
    for (int i = 0; i < 32; ++i) {
      if (condition()) return true;
      pause();
    }
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

void WorkerThreads::work() noexcept {
  prefault_stack();
  const std::uint32_t worker = started_.fetch_add(1) + 1;
  while (left_.load() != kStop) {
    take_parts(worker);
    if (spin_until([this] { return left_.load(std::memory_order_relaxed) != 0; })) continue;
    // Whoever sets left_ looks at asleep_ afterwards; here it is the other way round.
    asleep_.fetch_add(1);
    wait_while(left_, 0);
    asleep_.fetch_sub(1);
  }
}

// What is claimed is one of the parts that are left, of whatever task they are by now: a thread
// that slept between reading and exchanging cannot take a part that is not there. The task is read
// after that, and stays what it is until the part is done.
std::uint32_t WorkerThreads::take_parts(std::uint32_t worker) noexcept {
  std::uint32_t taken = 0;
  std::uint32_t left = left_.load(std::memory_order_relaxed);
  while (left != 0 && left != kStop) {
    if (!left_.compare_exchange_weak(left, left - 1, std::memory_order_acquire,
                                     std::memory_order_relaxed)) {
      continue;
    }
    part_(task_, parts_ - left, worker);
    ++taken;
    if (worker != 0 &&
        unfinished_.fetch_sub(1, std::memory_order_acq_rel) == (kCallerSleeps | 1U)) {
      wake(unfinished_, 1);
    }
    left = left_.load(std::memory_order_relaxed);
  }
  return taken;
}

void WorkerThreads::run(std::uint32_t parts, Executor::Part part, void* task) noexcept {
  const bool is_shared = threads_ > 0 && parts > 1 && parts < kCallerSleeps &&
                         !busy_.exchange(true, std::memory_order_acquire);
  if (!is_shared) {
    for (std::uint32_t i = 0; i < parts; ++i) part(task, i, 0);
    return;
  }
  part_ = part;
  task_ = task;
  parts_ = parts;
  unfinished_.store(parts, std::memory_order_relaxed);
  left_.store(parts);
  if (asleep_.load() > 0) wake(left_, parts - 1);
  const std::uint32_t own = take_parts(0);
  ++counts_.tasks;
  counts_.parts_by_threads += parts - own;
  wait_for_threads(own);
  busy_.store(false, std::memory_order_release);
}

void WorkerThreads::wait_for_threads(std::uint32_t own) noexcept {
  if (unfinished_.fetch_sub(own, std::memory_order_acquire) == own) return;
  ++counts_.waits;
  if (spin_until([this] { return unfinished_.load(std::memory_order_acquire) == 0; })) return;
  unfinished_.fetch_or(kCallerSleeps, std::memory_order_acquire);
  for (;;) {
    const std::uint32_t unfinished = unfinished_.load(std::memory_order_acquire);
    if (unfinished == kCallerSleeps) return;
    wait_while(unfinished_, unfinished);
  }
}

}  // namespace unimapper::linux_port
