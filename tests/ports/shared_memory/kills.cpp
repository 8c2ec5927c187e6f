// Kill storm of shared memory: consumers and writers that end with SIGKILL at every step.
//   share_kills CONSUMERS WRITERS
//
// Prints what was torn, leaked, dropped or lost; ends with 1 if anything was.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "ports/shared_memory/reader.hpp"
#include "ports/shared_memory/steps.hpp"
#include "ports/shared_memory/writer.hpp"
#include "tests/ports/shared_memory/message.hpp"

namespace {

using namespace unimapper::shared_memory;
using test::fill;
using test::is_whole;

// Where this process ends.
bool ends = false;
Step last_step = Step::kConsumerLocked;
std::uint32_t steps_left = 0;

constexpr std::size_t kBytes = 64U << 10U;
constexpr std::uint32_t kConsumers = 3;
constexpr std::uint32_t kRandom = ~0U;

struct Counters {
  std::uint32_t killed = 0;   // where they should
  std::uint32_t astray = 0;   // ended otherwise
  std::uint32_t torn = 0;     // messages that were not whole
  std::uint32_t leaked = 0;   // slots or leases that were not free afterwards
  std::uint32_t dropped = 0;  // messages the writer had no chunk for
  std::uint32_t lost = 0;     // messages a consumer missed though it kept up, or had twice
  [[nodiscard]] bool clean() const { return astray + torn + leaked + dropped + lost == 0; }
};

constexpr WriterOptions kOptions{
    .message_bytes = kBytes, .consumers = kConsumers, .leases = 2, .history = 3};

/// Publishes one message; false if there was no chunk for it.
bool publish(Writer& writer, std::uint64_t seed) {
  const std::span<std::byte> memory = writer.loan();
  if (memory.size() != kBytes) return false;
  fill(memory, seed);
  return writer.publish(kBytes, static_cast<std::int64_t>(seed)) != 0;
}

/// This process ends when it has taken that step so many times.
void end_at(std::uint32_t step, std::uint32_t times) {
  last_step = static_cast<Step>(step);
  steps_left = times;
  ends = true;
}

/// Counts how a child ended; `failed` if it found a fault itself.
void count_end(int status, Counters& counters, std::uint32_t& failed) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) {
    ++counters.killed;
  } else {
    ++(WIFEXITED(status) && WEXITSTATUS(status) == 3 ? failed : counters.astray);
  }
}

/// Takes all there is and checks it.
void drain(Reader& reader, Counters& counters, std::uint32_t& last) {
  Sample sample;
  while (reader.take(sample) == Taken::kMessage) {
    if (!is_whole(sample.bytes()) || !sample.intact()) ++counters.torn;
    if (sample.sequence() != last + 1) ++counters.lost;
    last = sample.sequence();
  }
}

/// A child: takes messages until it is killed.
[[noreturn]] void consume(const std::string& share, std::uint32_t at, std::uint32_t times) {
  if (at != kRandom) end_at(at, times);
  Reader reader;
  if (!reader.open(share, "storm", {.start = ReaderOptions::Start::kOldest}).ok) _exit(2);
  std::array<Sample, 2> samples;
  for (std::uint32_t i = 0;; ++i) {
    Sample& sample = samples[i % 2];
    const Taken taken = reader.take(sample);
    if (taken == Taken::kMessage && (!is_whole(sample.bytes()) || !sample.intact())) _exit(3);
    if (taken == Taken::kFailed || taken == Taken::kLeasesUsed) _exit(4);
    if (taken == Taken::kNothing) (void)reader.wait(100'000'000);
  }
}

Counters kill_consumers(const std::string& share, std::uint32_t count) {
  Counters counters;
  Writer writer;
  if (!writer.open(share, "storm", kOptions).ok) std::abort();
  if (!publish(writer, 1)) std::abort();
  Reader steady;
  if (!steady.open(share, "storm").ok) std::abort();
  std::uint32_t last = 0;
  drain(steady, counters, last);
  constexpr auto kSteps = static_cast<std::uint32_t>(Step::kMessageReleased) + 1;
  std::uint64_t random = 1;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t step = i % (kSteps + 1);
    const std::uint32_t times = step <= 1 ? 1 : 1 + i / (kSteps + 1) % 5;
    const pid_t child = fork();
    if (child == 0) consume(share, step == kSteps ? kRandom : step, times);
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    const std::uint64_t patience = step == kSteps ? random >> 60U : ~0ULL;
    int status = 0;
    for (std::uint64_t turn = 0; waitpid(child, &status, WNOHANG) == 0; ++turn) {
      if (turn >= patience) kill(child, SIGKILL);
      counters.dropped += publish(writer, i + turn) ? 0 : 1;
      drain(steady, counters, last);
    }
    count_end(status, counters, counters.torn);
    // What the dead hold is held for now, and the writer goes on.
    if (i % 7 != 0) continue;
    (void)writer.reclaim();
    for (std::uint32_t slot = 0; slot < writer.slots(); ++slot) {
      const ConsumerState state = writer.consumer(slot);
      counters.leaked += state.present != (slot == steady.slot()) || state.leases != 0 ? 1 : 0;
    }
  }
  writer.remove();
  return counters;
}

/// A child: takes over and publishes until it is killed.
[[noreturn]] void write(const std::string& share, std::uint32_t at, std::uint32_t times,
                        std::uint64_t seed) {
  const bool in_message = at == kRandom;
  if (!in_message) end_at(at, times);
  Writer writer;
  if (!writer.open(share, "storm", kOptions).ok) _exit(2);
  for (std::uint64_t i = 0; i < 16; ++i) {
    const std::span<std::byte> memory = writer.loan();
    if (memory.size() != kBytes) _exit(3);
    if (in_message && i == times) {
      fill(memory.first(kBytes / 2), seed);
      kill(getpid(), SIGKILL);
    }
    fill(memory, seed + i);
    if (writer.publish(kBytes, 0) == 0) _exit(3);
  }
  _exit(4);
}

Counters kill_writers(const std::string& share, std::uint32_t count) {
  Counters counters;
  {
    Writer first;
    if (!first.open(share, "storm", kOptions).ok || !publish(first, 1)) std::abort();
  }
  auto steady = std::make_unique<Reader>();
  if (!steady->open(share, "storm").ok) std::abort();
  Sample held;  // on lease all the time, whoever writes
  if (steady->take(held) != Taken::kMessage) std::abort();
  constexpr auto kFirst = static_cast<std::uint32_t>(Step::kWriterLocked);
  constexpr std::uint32_t kWriterSteps = kSteps - kFirst;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t step = i % (kWriterSteps + 1);
    const std::uint32_t times = step < 3 ? 1 : 1 + i / (kWriterSteps + 1) % 3;
    const pid_t child = fork();
    if (child == 0) write(share, step == kWriterSteps ? kRandom : kFirst + step, times, i);
    int status = 0;
    (void)waitpid(child, &status, 0);
    count_end(status, counters, counters.dropped);
    if (steady->is_replaced() || steady->has_writer()) ++counters.leaked;
    Sample sample;
    while (steady->take(sample) == Taken::kMessage) {
      if (!is_whole(sample.bytes()) || !sample.intact()) ++counters.torn;
      counters.lost += sample.missed();
    }
    if (!is_whole(held.bytes()) || !held.intact()) ++counters.torn;
    Reader late;
    Sample latest;
    if (!late.open(share, "storm").ok || late.take(latest) != Taken::kMessage ||
        latest.sequence() != late.latest() || !is_whole(latest.bytes())) {
      ++counters.lost;
    }
  }
  held.release();
  steady.reset();
  Writer last;
  if (!last.open(share, "storm", kOptions).ok || !publish(last, 1)) ++counters.leaked;
  last.remove();
  return counters;
}

void print(const char* who, const Counters& counters) {
  std::printf("%u %s killed, %u astray, %u torn, %u leaked, %u dropped, %u lost\n", counters.killed,
              who, counters.astray, counters.torn, counters.leaked, counters.dropped,
              counters.lost);
}

}  // namespace

namespace unimapper::shared_memory {

void step(Step done) noexcept {
  if (ends && done == last_step && --steps_left == 0) kill(getpid(), SIGKILL);
}

}  // namespace unimapper::shared_memory

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: share_kills CONSUMERS WRITERS\n");
    return 2;
  }
  const std::string share = "kills-" + std::to_string(getpid());
  const auto number = [](const char* text) {
    return static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10));
  };
  const Counters consumers = kill_consumers(share, number(argv[1]));
  print("consumers", consumers);
  const Counters writers = kill_writers(share, number(argv[2]));
  print("writers", writers);
  return consumers.clean() && writers.clean() ? 0 : 1;
}
