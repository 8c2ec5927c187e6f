// Fuzz target of lease tables: a hostile consumer hurts neither the writer nor another consumer.
//
// The input is what the hostile one writes into its own table between the steps of the others. The
// oracle: every message is published, and the victim reads each of them whole.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "tests/fuzz/fuzz.hpp"
#include "tests/ports/shared_memory/message.hpp"
#include "tests/ports/shared_memory/share.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::shared_memory;
using fuzz::require;

/// A topic with a writer, a victim and the hostile consumer's table; made once. Its files have no
/// names any more: they are used by this process alone.
struct HostileTopic {
  unimapper::test::ConsumedTopic topic{{.message_bytes = 64, .consumers = 2}};
  File hostile = topic.file(FilePart::kConsumer, 1);
  std::array<Sample, 2> held;  // goes before its reader

  HostileTopic() {
    require(hostile.is_open());
    topic.share.remove_files();
  }
};

void publish(Writer& writer, std::uint64_t seed) {
  const std::span<std::byte> memory = writer.loan();
  require(memory.size() == 64);
  shared_memory::test::fill(memory, seed);
  require(writer.publish(memory.size(), 0) != 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static HostileTopic all;
  auto& [topic, hostile, held] = all;
  std::size_t next = 0;
  for (std::size_t at = 0; at < size;) {
    const std::uint8_t what = data[at++];
    const std::size_t bytes = std::min<std::size_t>(what >> 2U, size - at);
    if (what % 4 == 0) {
      require(ftruncate(hostile.descriptor(), what) == 0);
    } else if (bytes > 0) {
      (void)!pwrite(hostile.descriptor(), data + at, bytes, what % 4 == 1 ? 0 : what % 32);
    }
    at += bytes;
    publish(topic.writer, at);
    Sample& sample = held.at(next++ % 2);
    require(topic.reader.take(sample) == Taken::kMessage);
    require(sample.missed() == 0);
    for (const Sample& one : held) {
      require(!one.has_message() || (one.intact() && shared_memory::test::is_whole(one.bytes())));
    }
  }
  return 0;
}
