// Bench of the durable store: memory, rate and bytes written for many keyframes of many robots.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <span>
#include <string>

#include "ports/store/keyframe_store.hpp"
#include "ports/store/process_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/pieces.hpp"
#include "unimapper/wire/receiver.hpp"

using namespace unimapper;

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kPieceBytes = 59000;

/// A line of /proc/self/status in MB: VmRSS or VmHWM.
double memory_mb(const std::string& name) {
  std::ifstream file("/proc/self/status");
  std::string word;
  double kilobytes = 0.0;
  while (file >> word) {
    if (word == name + ":" && file >> kilobytes) return kilobytes / 1024.0;
  }
  return 0.0;
}

/// Cells scattered so that each takes about two bytes.
KeyframeRecord record_with(std::uint32_t cells) {
  KeyframeRecord record;
  record.scans.resize(1);
  std::uint64_t state = 1;
  const auto next = [&state] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<float>(state >> 40U) / static_cast<float>(1U << 24U) - 0.5F;
  };
  for (std::uint32_t i = 0; i < cells; ++i) {
    FineCell cell{};
    cell.position = {60.0F * next(), 60.0F * next(), 12.0F * next()};
    cell.points = 1;
    record.static_cells.push_back(cell);
  }
  return record;
}

// store_bench FOLDER ROBOTS KEYFRAMES CELLS
void run(std::span<char*> arguments) {
  const auto number = [&arguments](std::size_t i) {
    return static_cast<std::uint32_t>(std::strtoul(arguments[i], nullptr, 10));
  };
  const std::uint32_t robots = number(2);
  const std::uint32_t keyframes = number(3);
  KeyframeRecord record = record_with(number(4));
  const auto written_before = store::bytes_written_to_disk();
  store::KeyframeStore kept(arguments[1]);
  wire::Receiver receiver({}, kept);
  const Clock::time_point start = Clock::now();
  const auto tell = [&](std::uint32_t made) {
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    const store::StoreCounters& counters = kept.counters();
    std::printf(
        "%u keyframes of %u robots: RSS %.1f MB (peak %.1f), %.0f s, %.0f keyframes/s, "
        "%.1f MB/s\n",
        made, robots, memory_mb("VmRSS"), memory_mb("VmHWM"), seconds,
        static_cast<double>(counters.keyframes) / seconds,
        static_cast<double>(counters.bytes) * 1e-6 / seconds);
    std::fflush(stdout);
  };
  for (std::uint32_t sequence = 0; sequence < keyframes; ++sequence) {
    for (std::uint32_t robot = 0; robot < robots; ++robot) {
      record.session = {robot, 7};
      record.sequence = sequence;
      const wire::EncodedKeyframe keyframe{record.session, sequence, 0,
                                           wire::encode_keyframe(record)};
      for (auto& piece : wire::cut_into_pieces(keyframe, kPieceBytes)) {
        receiver.receive(std::move(piece));
      }
    }
    receiver.advance(std::chrono::nanoseconds(Clock::now().time_since_epoch()).count());
    if ((sequence + 1) % (keyframes / 10 + 1) == 0) tell(sequence + 1);
  }
  receiver.store_all();
  tell(keyframes);
  const store::StoreCounters& counters = kept.counters();
  const std::uint64_t wanted = std::uint64_t{robots} * keyframes;
  const auto written = store::bytes_written_to_disk();
  std::printf("stored %llu of %llu keyframes, %llu bytes, in %llu commits\n",
              static_cast<unsigned long long>(counters.keyframes),
              static_cast<unsigned long long>(wanted),
              static_cast<unsigned long long>(counters.bytes),
              static_cast<unsigned long long>(counters.commits));
  const double bytes = static_cast<double>(counters.bytes);
  const double ratio =
      written && written_before ? static_cast<double>(*written - *written_before) / bytes : 0.0;
  const auto milliseconds = [](std::chrono::nanoseconds time) {
    return std::chrono::duration<double, std::milli>(time).count();
  };
  std::printf("a commit took %.1f ms, the longest %.1f ms\n",
              milliseconds(counters.commit_time) / static_cast<double>(counters.commits),
              milliseconds(counters.longest_commit));
  std::printf("cells: %.0f | %llu | %.1f | %.1f | %.1f\n",
              bytes / static_cast<double>(counters.keyframes),
              static_cast<unsigned long long>(counters.commits), memory_mb("VmRSS"),
              memory_mb("VmHWM"), ratio);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: store_bench FOLDER ROBOTS KEYFRAMES CELLS\n");
    return 2;
  }
  try {
    run({argv, static_cast<std::size_t>(argc)});
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
