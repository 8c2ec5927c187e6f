// Fuzz target of lease tables: a hostile consumer hurts neither the writer nor another consumer.
//
// The input is what the hostile one writes into its own table between the steps of the others. The
// oracle: every message is published, and the victim reads each of them whole.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include "ports/shared_memory/reader.hpp"
#include "ports/shared_memory/writer.hpp"
#include "tests/ports/shared_memory/message.hpp"

namespace {

using namespace unimapper::shared_memory;

/// A topic with a writer, a victim and the hostile consumer's table; made once.
class Topic {
 public:
  Topic() {
    const std::string share = "fuzz-" + std::to_string(getpid());
    WriterOptions options;
    options.message_bytes = 64;
    options.consumers = 2;
    if (!writer.open(share, "tables", options).ok) std::abort();
    if (!victim.open(share, "tables").ok) std::abort();
    hostile = open_file(file_name(share, "tables", FilePart::kConsumer, 1), true);
    if (!hostile.is_open()) std::abort();
    // The files are used by this process alone.
    remove_names(share);
  }

  Writer writer;
  Reader victim;
  File hostile;
  std::array<Sample, 2> held;  // goes before its reader

 private:
  static void remove_names(const std::string& share) {
    (void)shm_unlink(file_name(share, "tables", FilePart::kSegment).text);
    (void)shm_unlink(file_name(share, "tables", FilePart::kWriterLock).text);
    for (std::uint32_t i = 0; i < 2; ++i) {
      (void)shm_unlink(file_name(share, "tables", FilePart::kConsumer, i).text);
    }
  }
};

void publish(Topic& topic, std::uint64_t seed) {
  const std::span<std::byte> memory = topic.writer.loan();
  if (memory.size() != 64) std::abort();
  unimapper::shared_memory::test::fill(memory, seed);
  if (topic.writer.publish(memory.size(), 0) == 0) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Topic topic;
  std::size_t next = 0;
  for (std::size_t at = 0; at < size;) {
    const std::uint8_t what = data[at++];
    const std::size_t bytes = std::min<std::size_t>(what >> 2U, size - at);
    if (what % 4 == 0) {
      if (ftruncate(topic.hostile.descriptor(), what) != 0) std::abort();
    } else if (bytes > 0) {
      (void)!pwrite(topic.hostile.descriptor(), data + at, bytes, what % 4 == 1 ? 0 : what % 32);
    }
    at += bytes;
    publish(topic, at);
    Sample& sample = topic.held.at(next++ % 2);
    if (topic.victim.take(sample) != Taken::kMessage) std::abort();
    if (sample.missed() != 0) std::abort();
    for (const Sample& held : topic.held) {
      if (!held.has_message()) continue;
      if (!held.intact() || !unimapper::shared_memory::test::is_whole(held.bytes())) std::abort();
    }
  }
  return 0;
}
