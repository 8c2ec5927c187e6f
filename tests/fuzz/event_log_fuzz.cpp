// Fuzz target of the event log reader.
//
// Events lie in sequence within the file, hold the file's bytes, and reading terminates.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include "ports/lcm/event_log.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace unimapper::lcm_port;
  static const int file = memfd_create("event_log", 0);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  if (ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) {
    std::abort();
  }
  EventLogReader reader(path);
  LogEvent event;
  std::uint64_t end = 0;
  while (reader.next(event)) {
    const std::uint64_t bytes = 28 + event.channel.size() + event.data.size();
    if (event.offset < end || event.offset + bytes > size) std::abort();
    end = event.offset + bytes;
    const std::uint8_t* content = data + event.offset + 28 + event.channel.size();
    if (!event.data.empty() && std::memcmp(content, event.data.data(), event.data.size()) != 0) {
      std::abort();
    }
  }
  // Every byte is either in an event or reported.
  if (end != size && reader.fault_count() == 0) std::abort();
  return 0;
}
