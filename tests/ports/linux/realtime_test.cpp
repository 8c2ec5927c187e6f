// Tests of the real-time helpers: granted requests take effect, refused ones are explained.
#include "ports/linux/realtime.hpp"

#include <sched.h>

#include <cerrno>

#include "poor_child.hpp"
#include "tests/test.hpp"

using namespace unimapper::linux_port;
using namespace unimapper::test;
using Catch::Matchers::Contains;

TEST_CASE("prefaulted memory keeps its contents") {
  std::vector<std::byte> bytes(100000, std::byte{7});
  CHECK(prefault(bytes).ok);
  CHECK(bytes == std::vector<std::byte>(100000, std::byte{7}));
  CHECK_THAT(prefault({}).message, Contains("empty"));
}

TEST_CASE("a priority or core that cannot exist is refused with a sentence") {
  for (const int priority : {-1, 0, 100}) {
    CHECK_FALSE(set_realtime_priority(priority).ok);
    CHECK_THAT(set_realtime_priority(priority).message, Contains("1 to 99"));
  }
  CHECK_THAT(pin_to_core(-1).message, Contains("core"));
  CHECK_THAT(pin_to_core(1023).message, Contains("no such core"));
  CHECK(pin_to_core(1023).error_number == EINVAL);
}

TEST_CASE("a thread can be pinned to a core it may use") {
  int ran_on = -1;
  std::thread([&] {
    const int here = sched_getcpu();
    if (pin_to_core(here).ok) ran_on = sched_getcpu() == here ? 1 : 0;
  }).join();
  CHECK(ran_on == 1);
}

TEST_CASE("without the right to it, SCHED_FIFO is refused and the remedy named") {
  CHECK(in_poor_child([] { return says(set_realtime_priority(80), "CAP_SYS_NICE"); }) ==
        kRefusedWell);
}

// Sanitizers replace mlockall by one that always succeeds and does nothing.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_CASE("without the right to it, locking memory is refused and the remedy named") {
  CHECK(in_poor_child([] { return says(lock_memory(), "RLIMIT_MEMLOCK"); }) == kRefusedWell);
}
#endif

TEST_CASE("granted requests take effect") {
  Outcome fifo;
  int policy = -1;
  std::thread([&] {
    fifo = set_realtime_priority(1);
    policy = sched_getscheduler(0);
  }).join();
  CHECK((policy == SCHED_FIFO) == fifo.ok);
  CHECK((std::string(fifo.message).empty()) == fifo.ok);
}
