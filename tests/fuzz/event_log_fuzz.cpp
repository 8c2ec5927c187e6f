// Fuzz target of the event log reader.
//
// Events lie in sequence within the file, hold the file's bytes, and reading terminates.
#include <cstdint>
#include <cstring>

#include "ports/lcm/event_log.hpp"
#include "tests/fuzz/fuzz.hpp"

using unimapper::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace unimapper::lcm_port;
  const std::string& path = unimapper::fuzz::file_of({data, size});
  EventLogReader reader(path);
  LogEvent event;
  std::uint64_t end = 0;
  while (reader.next(event)) {
    const std::uint64_t bytes = 28 + event.channel.size() + event.data.size();
    require(event.offset >= end && event.offset + bytes <= size);
    end = event.offset + bytes;
    const std::uint8_t* content = data + event.offset + 28 + event.channel.size();
    require(event.data.empty() || std::memcmp(content, event.data.data(), event.data.size()) == 0);
  }
  // Every byte is either in an event or reported.
  require(end == size || reader.fault_count() > 0);
  return 0;
}
