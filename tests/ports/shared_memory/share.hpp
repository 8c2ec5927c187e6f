// Shares of tests: a name of its own for each, removed afterwards.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <span>
#include <stdexcept>
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
  ~TestShare() { remove_files(); }
  TestShare(const TestShare&) = delete;
  TestShare& operator=(const TestShare&) = delete;

  /// Who has them open keeps them.
  void remove_files() const {
    using namespace shared_memory;
    for (const char* topic : {"topic", "keyframe", "labels", "health"}) {
      (void)shm_unlink(file_name(name_, topic, FilePart::kSegment).text);
      (void)shm_unlink(file_name(name_, topic, FilePart::kWriterLock).text);
      for (std::uint32_t i = 0; i < kMaxConsumers; ++i) {
        (void)shm_unlink(file_name(name_, topic, FilePart::kConsumer, i).text);
      }
    }
  }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  std::string name_;
};

/// A topic of few and small messages.
inline shared_memory::WriterOptions small() {
  return {.message_bytes = 64, .consumers = 2, .leases = 2, .history = 3};
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

/// What the next message says; empty without one.
inline std::string take_text(shared_memory::Reader& reader) {
  shared_memory::Sample sample;
  return reader.take(sample) == shared_memory::Taken::kMessage ? text_of(sample) : "";
}

/// A topic with its writer.
struct Topic {
  TestShare share;
  shared_memory::Writer writer;

  explicit Topic(const shared_memory::WriterOptions& options = small()) { open(options); }
  void open(const shared_memory::WriterOptions& options = small()) {
    expect(writer.open(share.name(), "topic", options));
  }
  void open(shared_memory::Reader& consumer,
            const shared_memory::ReaderOptions& options = {}) const {
    expect(consumer.open(share.name(), "topic", options));
  }
  void publish(const std::string& text, int times = 1) {
    for (int i = 0; i < times; ++i) {
      if (test::publish(writer, text) == 0) throw std::runtime_error("not published: " + text);
    }
  }
  /// Publishes these numbers as text.
  void publish_numbers(int first, int last) {
    for (int i = first; i <= last; ++i) publish(std::to_string(i));
  }
  [[nodiscard]] shared_memory::File file(shared_memory::FilePart part, std::uint32_t slot = 0,
                                         bool writable = true) const {
    return open_file(file_name(share.name(), "topic", part, slot), writable);
  }

 private:
  static void expect(const shared_memory::Outcome& outcome) {
    if (!outcome.ok) throw std::runtime_error(outcome.message);
  }
};

/// Likewise, and a consumer that was there before the first message.
struct ConsumedTopic : Topic {
  shared_memory::Reader reader;
  explicit ConsumedTopic(const shared_memory::WriterOptions& options = small()) : Topic(options) {
    open(reader);
  }
};

}  // namespace unimapper::test
