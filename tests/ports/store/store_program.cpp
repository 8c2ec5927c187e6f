// Base process for the tests that kill it: messages from standard input, answers to standard
// output.
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <span>
#include <string_view>
#include <vector>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/store/keyframe_store.hpp"
#include "tests/ports/store/frames.hpp"

using namespace unimapper;
using store::store_test::Frames;

namespace {

/// From now on no file grows beyond so many bytes, and the write that would is an error.
void limit_files(const char* bytes) {
  const rlimit limit{std::strtoull(bytes, nullptr, 10), RLIM_INFINITY};
  if (setrlimit(RLIMIT_FSIZE, &limit) != 0) std::abort();
  std::signal(SIGXFSZ, SIG_IGN);
}

// store_program FOLDER [BYTES_PER_FILE]
void run(std::span<char*> arguments) {
  store::StoreOptions options;
  options.batch_interval_ns = 5'000'000;
  options.retry_interval_ns = 20'000'000;
  store::KeyframeStore kept(arguments[1], options);
  wire::Receiver receiver({}, kept);
  if (arguments.size() > 2) limit_files(arguments[2]);
  Frames frames;
  for (;;) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, 2) > 0 && !frames.read_from(STDIN_FILENO)) return;
    while (const auto frame = frames.next()) {
      lcm_port::receive(receiver, frame->channel, frame->data);
    }
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    receiver.advance(std::chrono::nanoseconds(now).count());
    for (const wire::StoredMessage& message : receiver.take_stored()) {
      const std::vector<std::uint8_t> bytes =
          Frames::frame(lcm_port::kStoredChannel, lcm_port::encode(message));
      if (write(STDOUT_FILENO, bytes.data(), bytes.size()) < 0) return;
    }
    if (!kept.trouble().empty()) std::fprintf(stderr, "%s\n", kept.trouble().c_str());
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run({argv, static_cast<std::size_t>(argc)});
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
