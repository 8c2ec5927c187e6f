// Tests of consumers and threads that wait for messages.
#include <unistd.h>

#include "tests/ports/shared_memory/share.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::ConsumedTopic;
using test::small;
using test::Topic;

TEST_CASE("A consumer and a thread beside the writer that wait are woken by the next message") {
  ConsumedTopic topic;
  CHECK(Writer().wait_beyond(0, 1) == 0);  // not open
  CHECK(topic.writer.wait_beyond(0, 1'000'000) == 0);
  CHECK_FALSE(topic.reader.wait(1'000'000));
  std::atomic<std::uint32_t> heard{0};
  std::atomic<bool> waited{false};
  std::thread announcer([&] {
    while (heard == 0) heard = topic.writer.wait_beyond(0, 60'000'000'000);
  });
  std::thread consumer([&] { waited = topic.reader.wait(60'000'000'000); });
  usleep(20'000);
  topic.publish("first");
  announcer.join();
  consumer.join();
  CHECK(heard == 1);
  CHECK(waited);
  // At once.
  CHECK(topic.writer.wait_beyond(0, 60'000'000'000) == 1);
  CHECK(topic.reader.wait(0));
}

TEST_CASE("Two consumers in threads get every message whole while the writer hurries") {
  WriterOptions options = small();
  options.message_bytes = 4096;
  Topic topic(options);
  constexpr std::uint32_t kMessages = 3000;
  std::array<std::uint32_t, 2> seen{};
  std::array<std::uint32_t, 2> torn{};
  std::array<Reader, 2> readers;
  for (Reader& reader : readers) topic.open(reader);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 2; ++i) {
    threads.emplace_back([&, i] {
      std::uint32_t last = 0;
      while (last < kMessages && readers.at(i).wait(10'000'000'000)) {
        Sample sample;
        if (readers.at(i).take(sample) != Taken::kMessage) continue;
        const std::span<const std::byte> bytes = sample.bytes();
        torn.at(i) += std::memcmp(bytes.data(), bytes.data() + 1, bytes.size() - 1) == 0 ? 0 : 1;
        seen.at(i) += 1 + sample.missed();
        last = sample.sequence();
      }
    });
  }
  for (std::uint32_t i = 0; i < kMessages; ++i) {
    const std::span<std::byte> memory = topic.writer.loan();
    std::memset(memory.data(), static_cast<int>(i % 251), memory.size());
    if (topic.writer.publish(memory.size(), 0) == 0) break;
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(topic.writer.latest() == kMessages);
  CHECK(torn == std::array<std::uint32_t, 2>{});
  CHECK(seen == std::array<std::uint32_t, 2>{kMessages, kMessages});
}
