// Tests of the worker threads: every part once, late and ended threads, refusals.
#include "ports/linux/executor.hpp"

#include <sched.h>

#include <cerrno>

#include "poor_child.hpp"
#include "ports/linux/allocation_counter.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::linux_port;
using namespace unimapper::test;
using Catch::Matchers::Contains;

namespace {

/// Runs `part(number, worker)` for each number below `parts`.
template <typename Part>
void run(const Executor& executor, std::uint32_t parts, Part part) {
  executor.run(
      executor.context, parts,
      [](void* task, std::uint32_t number, std::uint32_t worker) {
        (*static_cast<Part*>(task))(number, worker);
      },
      &part);
}

void be_busy(std::chrono::nanoseconds duration) {
  const auto end = std::chrono::steady_clock::now() + duration;
  while (std::chrono::steady_clock::now() < end) {
  }
}

/// Waits until `is_so`, or for ten seconds. Whether it became so.
template <typename Condition>
bool wait_until(Condition is_so) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!is_so()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::yield();
  }
  return true;
}

/// Cores for so many threads: any, but where the tests have one only, that one.
std::vector<int> cores_for(std::size_t threads) {
  cpu_set_t own;
  CPU_ZERO(&own);
  sched_getaffinity(0, sizeof own, &own);
  return std::vector<int>(threads, CPU_COUNT(&own) > 1 ? WorkerThreads::kAnyCore : sched_getcpu());
}

}  // namespace

TEST_CASE("every part is done once, and no two workers with one number at a time") {
  std::mt19937 random(1);
  for (std::uint32_t workers = 1; workers <= 4; ++workers) {
    WorkerThreads threads(cores_for(workers - 1));
    REQUIRE(threads.outcome().ok);
    const Executor executor = threads.executor();
    REQUIRE(executor.workers == workers);
    std::array<std::atomic<bool>, 4> in_use = {};
    std::atomic<int> wrong = 0;
    for (int task = 0; task < 100; ++task) {
      std::vector<std::chrono::microseconds> durations(random() % 12);
      for (auto& duration : durations) duration = std::chrono::microseconds(random() % 40);
      std::vector<int> done(durations.size());  // plain: a part is one thread's
      run(executor, static_cast<std::uint32_t>(done.size()), [&](auto part, auto worker) {
        if (worker >= workers || in_use[worker].exchange(true)) ++wrong;
        be_busy(durations[part]);
        ++done[part];
        in_use[worker] = false;
      });
      wrong += static_cast<int>(done.size()) - static_cast<int>(std::ranges::count(done, 1));
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("no part is of the task before, however fast tasks follow each other") {
  for (const std::uint32_t workers : {2U, 4U}) {
    WorkerThreads threads(cores_for(workers - 1));
    const Executor executor = threads.executor();
    std::uint64_t wrong = 0;
    const std::uint32_t tasks = workers == 2 ? 90000 : 10000;
    for (std::uint32_t task = 0; task < tasks; ++task) {
      const std::uint32_t parts = task % 7;
      std::array<std::uint32_t, 7> done = {};
      if (task % 2 == 0) {
        run(executor, parts, [&](auto part, auto) { done[part] += 1; });
      } else {
        run(executor, parts, [&](auto part, auto) { done[part] += 3; });
      }
      const std::uint32_t right = task % 2 == 0 ? 1 : 3;
      for (std::uint32_t i = 0; i < done.size(); ++i) wrong += done[i] != (i < parts ? right : 0);
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("a thread that is woken and stuck in its part leaves all others to the caller") {
  WorkerThreads threads(cores_for(1));
  const Executor executor = threads.executor();
  std::this_thread::sleep_for(std::chrono::milliseconds(5));  // it sleeps by now
  constexpr std::uint32_t kParts = 50;
  std::atomic<std::uint32_t> by_caller = 0;
  std::atomic<std::uint32_t> by_thread = 0;
  std::atomic<bool> in_time = true;
  run(executor, kParts, [&](auto, auto worker) {
    if (worker == 0) {
      // The first part of all lasts until the thread has one, too.
      if (by_caller++ == 0 && !wait_until([&] { return by_thread > 0; })) in_time = false;
    } else if (by_thread++ == 0 && !wait_until([&] { return by_caller == kParts - 1; })) {
      in_time = false;
    } else {
      be_busy(std::chrono::milliseconds(2));  // longer than the caller spins
    }
  });
  CHECK(in_time);
  CHECK(by_caller == kParts - 1);
  CHECK(by_thread == 1);
  CHECK(threads.counts().tasks == 1);
  CHECK(threads.counts().parts_by_threads == 1);
  CHECK(threads.counts().waits == 1);
}

TEST_CASE("the caller does all parts once the threads have ended") {
  WorkerThreads threads(cores_for(2));
  const Executor executor = threads.executor();
  threads.stop();
  CHECK(threads.executor().workers == 1);
  std::vector<std::uint32_t> order;
  run(executor, 4, [&](auto part, auto worker) { order.push_back(10 * worker + part); });
  CHECK(order == std::vector<std::uint32_t>{0, 1, 2, 3});
  threads.stop();
}

TEST_CASE("a caller that finds the threads busy does its own task") {
  WorkerThreads threads(cores_for(1));
  const Executor executor = threads.executor();
  std::atomic<int> inner = 0;
  run(executor, 3, [&](auto, auto) { run(executor, 5, [&](auto, auto) { ++inner; }); });
  CHECK(inner == 15);
  std::array<std::uint64_t, 2> sums = {};
  const auto drive = [&](std::uint64_t& sum) {
    for (int task = 0; task < 1000; ++task) {
      std::array<std::uint64_t, 5> parts = {};
      run(executor, 5, [&](auto part, auto) { parts[part] = part; });
      sum += std::accumulate(parts.begin(), parts.end(), std::uint64_t{0});
    }
  };
  std::thread other([&] { drive(sums[1]); });
  drive(sums[0]);
  other.join();
  CHECK(sums == std::array<std::uint64_t, 2>{10000, 10000});
}

TEST_CASE("all parts are done where caller and thread have one core") {
  std::uint32_t done = 0;
  std::string refused;
  std::thread([&] {
    const int core = sched_getcpu();
    if (!pin_to_core(core).ok) return;
    WorkerThreads threads(std::array{core});
    for (int task = 0; task < 200; ++task) {
      std::array<std::uint32_t, 5> parts = {};
      run(threads.executor(), 5, [&](auto part, auto) { ++parts[part]; });
      done += static_cast<std::uint32_t>(std::ranges::count(parts, 1U));
    }
    refused = WorkerThreads(2).outcome().message;
  }).join();
  CHECK(done == 1000);
  CHECK_THAT(refused, Contains("only core"));
}

TEST_CASE("neither a task nor its parts allocate") {
  WorkerThreads threads(cores_for(2));
  const Executor executor = threads.executor();
  std::atomic<std::uint64_t> allocations = 0;
  const std::uint64_t before = AllocationGuard::count();
  {
    const AllocationGuard guard;
    for (int task = 0; task < 100; ++task) {
      run(executor, 6, [&](auto, auto worker) {
        if (worker == 0) return;
        const AllocationGuard in_part;
        allocations += AllocationGuard::count();
      });
    }
  }
  CHECK(AllocationGuard::count() == before);
  CHECK(allocations == 0);
}

TEST_CASE("threads have the caller's priority") {
  std::atomic<int> policy = SCHED_FIFO;
  bool is_granted = false;
  std::thread([&] {
    is_granted = set_realtime_priority(1).ok;
    WorkerThreads threads(cores_for(1));
    std::atomic<bool> helped = false;
    run(threads.executor(), 2, [&](auto, auto worker) {
      if (worker != 0) policy = sched_getscheduler(0);
      if (worker != 0) helped = true;
      wait_until([&] { return helped.load(); });
    });
  }).join();
  CHECK((policy == SCHED_FIFO) == is_granted);
}

TEST_CASE("if one thread is refused none runs, and a sentence says why") {
  for (const int core : {-2, 1023, 100000}) {
    WorkerThreads threads(std::array{sched_getcpu(), core});
    CHECK(threads.outcome().error_number == EINVAL);
    CHECK_THAT(threads.outcome().message, Contains("no such core"));
    CHECK(threads.executor().workers == 1);
    int done = 0;
    run(threads.executor(), 3, [&](auto, auto) { ++done; });
    CHECK(done == 3);
  }
  CHECK_THAT(WorkerThreads(Executor::kMaxWorkers + 1).outcome().message, Contains("1 to 8"));
  CHECK(WorkerThreads(0).executor().workers == 1);
}

// The thread sanitizer has a thread of its own, which does not survive a fork.
#if !defined(__SANITIZE_THREAD__)
TEST_CASE("without the right to it, another thread is refused and the remedy named") {
  const auto check = [] { return says(WorkerThreads(cores_for(1)).outcome(), "RLIMIT_NPROC"); };
  CHECK(in_poor_child(check, [] {
          const rlimit none{0, 0};
          setrlimit(RLIMIT_NPROC, &none);
        }) == kRefusedWell);
}

TEST_CASE("a priority that the caller does not hand on is refused and the remedy named") {
  static bool is_granted = false;
  const auto check = [] {
    return is_granted ? says(WorkerThreads(cores_for(1)).outcome(), "RLIMIT_RTPRIO") : kRefusedWell;
  };
  CHECK(in_poor_child(check, [] {
          sched_param lowest{};
          lowest.sched_priority = 1;
          is_granted = sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &lowest) == 0;
        }) == kRefusedWell);
}
#endif
