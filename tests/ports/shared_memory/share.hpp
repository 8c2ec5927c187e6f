// Shares of tests: a name of its own for each, removed afterwards.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <span>
#include <string>

#include "ports/shared_memory/reader.hpp"
#include "ports/shared_memory/segment.hpp"
#include "ports/shared_memory/writer.hpp"

namespace unimapper::test {

class TestShare {
 public:
  TestShare() {
    static std::atomic<int> next{0};
    name_ = "test-" + std::to_string(getpid()) + "-" + std::to_string(next++);
  }
  ~TestShare() {
    using namespace shared_memory;
    for (const char* topic : {"topic", "keyframe", "labels", "health"}) {
      (void)shm_unlink(file_name(name_, topic, FilePart::kSegment).text);
      (void)shm_unlink(file_name(name_, topic, FilePart::kWriterLock).text);
      for (std::uint32_t i = 0; i < kMaxConsumers; ++i) {
        (void)shm_unlink(file_name(name_, topic, FilePart::kConsumer, i).text);
      }
    }
  }
  TestShare(const TestShare&) = delete;
  TestShare& operator=(const TestShare&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  std::string name_;
};

/// A topic of few and small messages.
inline shared_memory::WriterOptions small() {
  shared_memory::WriterOptions options;
  options.message_bytes = 64;
  options.consumers = 2;
  options.leases = 2;
  options.history = 3;
  return options;
}

/// Publishes a text; its sequence.
inline std::uint32_t publish(shared_memory::Writer& writer, const std::string& text) {
  const std::span<std::byte> memory = writer.loan();
  if (memory.size() < text.size()) return 0;
  std::memcpy(memory.data(), text.data(), text.size());
  return writer.publish(text.size(), 7);
}

inline std::string text_of(const shared_memory::Sample& sample) {
  return {reinterpret_cast<const char*>(sample.bytes().data()), sample.bytes().size()};
}

}  // namespace unimapper::test
