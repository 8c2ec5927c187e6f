// Latency of shared memory from the writer's publish to the reader's sample in another process.
//   share_latency MEGABYTES MESSAGES [PRIORITY]
//
// The writer fills a message every 10 ms (100 Hz), stamps it and publishes it; the reader waits,
// takes it, reads its last byte and notes the time. With PRIORITY both have SCHED_FIFO on
// one core. Prints p50, p99 and the longest, microseconds.
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/shared_memory/message.hpp"
#include "ports/linux/realtime.hpp"
#include "ports/shared_memory/reader.hpp"
#include "ports/shared_memory/writer.hpp"

namespace {

using namespace unimapper::shared_memory;

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// `share` of the sorted values lie below.
double at(const std::vector<double>& sorted, double share) {
  return sorted.at(static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1)));
}

void print(const char* what, std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::printf("%s %.1f %.1f %.1f\n", what, at(values, 0.5), at(values, 0.99), values.back());
}

/// The reader, in a process of its own.
int read_messages(const std::string& share, std::uint32_t count) {
  Reader reader;
  while (!reader.open(share, "latency").ok) usleep(1000);
  std::vector<double> latency_us;
  std::uint32_t damaged = 0;
  latency_us.reserve(count);
  while (latency_us.size() + reader.missed() < count) {
    Sample sample;
    if (!reader.wait(2'000'000'000)) break;
    if (reader.take(sample) != Taken::kMessage) continue;
    volatile const std::byte* last = &sample.bytes().back();
    (void)*last;
    latency_us.push_back(static_cast<double>(now_ns() - sample.stamp_ns()) * 1e-3);
    damaged += unimapper::bench::is_whole(sample.bytes()) && sample.intact() ? 0 : 1;
  }
  if (latency_us.empty()) return 1;
  print("latency", latency_us);
  std::printf("messages %zu missed %u damaged %u\n", latency_us.size(), reader.missed(), damaged);
  return damaged == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: share_latency MEGABYTES MESSAGES [PRIORITY]\n");
    return 2;
  }
  if (argc == 4) {
    const auto core = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN)) - 1;
    for (const auto& granted : {unimapper::linux_port::pin_to_core(core),
                                unimapper::linux_port::set_realtime_priority(std::atoi(argv[3]))}) {
      if (!granted.ok) return std::fprintf(stderr, "%s\n", granted.message), 1;
    }
  }
  const std::size_t bytes = std::strtoul(argv[1], nullptr, 10) << 20U;
  const auto count = static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10));
  const std::string share = "latency-" + std::to_string(getpid());
  Writer writer;
  WriterOptions options;
  options.message_bytes = static_cast<std::uint32_t>(bytes);
  options.consumers = 2;
  const Outcome opened = writer.open(share, "latency", options);
  if (!opened.ok) {
    std::fprintf(stderr, "%s\n", opened.message);
    return 1;
  }
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    const int status = read_messages(share, count);
    std::fflush(stdout);
    _exit(status);
  }
  usleep(100'000);
  std::vector<double> loan_us;
  std::vector<double> publish_us;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::int64_t begin = now_ns();
    const std::span<std::byte> memory = writer.loan();
    const std::int64_t loaned = now_ns();
    unimapper::bench::fill(memory, i);
    const std::int64_t filled = now_ns();
    writer.publish(bytes, filled);
    publish_us.push_back(static_cast<double>(now_ns() - filled) * 1e-3);
    loan_us.push_back(static_cast<double>(loaned - begin) * 1e-3);
    usleep(10'000);
  }
  int status = 0;
  (void)waitpid(child, &status, 0);
  print("loan", loan_us);
  print("publish", publish_us);
  writer.remove();
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}
