// Test of a spool whose process is killed while it writes.
#include <signal.h>  // NOLINT: kill is POSIX
#include <sys/wait.h>
#include <unistd.h>

#include "ports/spool/spool.hpp"
#include "tests/ports/spool/keyframes.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::spool;
using namespace unimapper::spool::spool_test;

namespace {

constexpr std::size_t kBytes = 3000;

/// Adds keyframes until it is killed, acknowledges every third, and writes to `pipe` how many at
/// the front are durable.
[[noreturn]] void write_until_killed(const std::filesystem::path& folder, std::uint32_t first,
                                     int pipe) {
  SpoolOptions options = small();
  options.bytes = 100000000;
  options.segment_bytes = 50000;
  options.acknowledge_period = std::chrono::milliseconds(1);
  Spool spool(folder, options);
  std::uint32_t durable = first;
  for (std::uint32_t i = first;; ++i) {
    spool.add(kMonday, keyframe_of(kMonday, i, kBytes));
    const std::uint32_t before = durable;
    while (durable <= i && spool.is_durable(kMonday.id, durable)) ++durable;
    if (durable > before && write(pipe, &durable, sizeof durable) != sizeof durable) _exit(1);
    if (i % 3 == 0) spool.acknowledge(kMonday.id, {{i}});
    if (i - durable > 50) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace

TEST_CASE("a writer killed at any moment loses nothing that it called durable") {
  const TemporaryDirectory folder;
  std::uint32_t durable = 0;
  std::uint32_t random = 12345;
  for (int round = 0; round < 12; ++round) {
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      close(ends[0]);
      write_until_killed(folder / "spool", durable, ends[1]);
    }
    close(ends[1]);
    // Until it has written something, and then a moment longer, a different one each time.
    std::uint32_t said = durable;
    REQUIRE(read(ends[0], &said, sizeof said) == sizeof said);
    random = random * 1664525U + 1013904223U;
    std::this_thread::sleep_for(std::chrono::microseconds(random >> 18U));
    REQUIRE(kill(child, SIGKILL) == 0);
    do {
      durable = said;
    } while (read(ends[0], &said, sizeof said) == sizeof said);
    close(ends[0]);
    REQUIRE(waitpid(child, nullptr, 0) == child);

    Spool spool(folder / "spool");
    std::uint32_t lost = 0;
    for (std::uint32_t i = 0; i < durable; ++i) {
      lost += has_equal(spool, kMonday, i, kBytes) ? 0 : 1;
    }
    CHECK(lost == 0);
    CHECK(spool.counters().segments_skipped == 0);
  }
  CHECK(durable >= 12);
}
