// Tests of consumers and threads that wait for messages.
#include <unistd.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstring>
#include <thread>
#include <vector>

#include "tests/ports/shared_memory/share.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::publish;
using test::small;
using test::TestShare;

TEST_CASE("A consumer that waits is woken by the next message") {
  const TestShare share;
  Writer writer;
  REQUIRE(writer.open(share.name(), "topic", small()).ok);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  CHECK_FALSE(reader.wait(1'000'000));
  std::thread publisher([&] {
    usleep(20'000);
    (void)publish(writer, "x");
  });
  CHECK(reader.wait(60'000'000'000));
  publisher.join();
  CHECK(reader.wait(0));
}

TEST_CASE("A thread beside the writer is woken by the next message, as the consumer is") {
  const TestShare share;
  Writer writer;
  CHECK(writer.wait_beyond(0, 1) == 0);  // not open
  REQUIRE(writer.open(share.name(), "topic", {.message_bytes = 64, .consumers = 1}).ok);
  CHECK(writer.wait_beyond(0, 1'000'000) == 0);
  Reader reader;
  REQUIRE(reader.open(share.name(), "topic").ok);
  std::atomic<std::uint32_t> heard{0};
  std::atomic<bool> waited{false};
  std::thread announcer([&] {
    while (heard == 0) heard = writer.wait_beyond(0, 60'000'000'000);
  });
  std::thread consumer([&] { waited = reader.wait(60'000'000'000); });
  CHECK(publish(writer, "first") == 1);
  announcer.join();
  consumer.join();
  CHECK(heard == 1);
  CHECK(waited);
  CHECK(writer.wait_beyond(0, 60'000'000'000) == 1);  // at once
}

TEST_CASE("Two consumers in threads get every message whole while the writer hurries") {
  const TestShare share;
  Writer writer;
  WriterOptions options = small();
  options.message_bytes = 4096;
  REQUIRE(writer.open(share.name(), "topic", options).ok);
  constexpr std::uint32_t kMessages = 3000;
  std::array<std::uint32_t, 2> seen{};
  std::array<std::uint32_t, 2> torn{};
  std::array<Reader, 2> readers;
  for (Reader& reader : readers) REQUIRE(reader.open(share.name(), "topic").ok);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 2; ++i) {
    threads.emplace_back([&, i] {
      std::uint32_t last = 0;
      while (last < kMessages && readers.at(i).wait(10'000'000'000)) {
        Sample sample;
        if (readers.at(i).take(sample) != Taken::kMessage) continue;
        for (const std::byte byte : sample.bytes()) {
          if (byte != sample.bytes().front()) {
            ++torn.at(i);
            break;
          }
        }
        seen.at(i) += 1 + sample.missed();
        last = sample.sequence();
      }
    });
  }
  for (std::uint32_t i = 0; i < kMessages; ++i) {
    const std::span<std::byte> memory = writer.loan();
    std::memset(memory.data(), static_cast<int>(i % 251), memory.size());
    if (writer.publish(memory.size(), 0) == 0) break;
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(writer.latest() == kMessages);
  CHECK(torn == std::array<std::uint32_t, 2>{});
  CHECK(seen == std::array<std::uint32_t, 2>{kMessages, kMessages});
}
