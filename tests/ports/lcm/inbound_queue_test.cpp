// Tests of the queue that is bounded by bytes.
#include "ports/lcm/inbound_queue.hpp"

#include "tests/test.hpp"

using namespace unimapper::lcm_port;
using Clock = std::chrono::steady_clock;

namespace {

InboundMessage message_of(std::size_t bytes, std::uint8_t mark = 0) {
  return {"UNIMAPPER_KEYFRAME", std::vector<std::uint8_t>(bytes, mark), {}};
}

}  // namespace

TEST_CASE("messages leave the queue as they came") {
  InboundQueue queue(100000);
  for (std::uint8_t i = 0; i < 10; ++i) CHECK(queue.push(message_of(100, i)));
  for (std::uint8_t i = 0; i < 10; ++i) {
    const auto message = queue.pop(Clock::now());
    REQUIRE(message);
    CHECK(message->data.at(0) == i);
  }
  CHECK_FALSE(queue.pop(Clock::now()));
  CHECK(queue.free_bytes() == 100000);
}

TEST_CASE("a flood is held to the bytes there is room for, whatever its datagrams' size") {
  const std::size_t bytes = GENERATE(0U, 1300U, 60000U);
  constexpr std::size_t kCapacity = 1000000;
  InboundQueue queue(kCapacity);
  std::size_t held = 0;
  for (int i = 0; i < 20000; ++i) held += queue.push(message_of(bytes)) ? 1 : 0;
  CHECK(held > 0);
  CHECK(held * (bytes + sizeof(InboundMessage)) <= kCapacity);
  CHECK(queue.free_bytes() < bytes + 200);
  CHECK(queue.dropped() == 20000 - held);
  // There is room again for what is taken.
  REQUIRE(queue.pop(Clock::now()));
  CHECK(queue.push(message_of(bytes)));
}

TEST_CASE("whoever waits is woken by a message, and by the end") {
  InboundQueue queue(1000);
  std::thread sender([&] {
    queue.push(message_of(10));
    queue.close();
  });
  CHECK(queue.pop(Clock::now() + std::chrono::seconds(20)));
  CHECK_FALSE(queue.pop(Clock::now() + std::chrono::seconds(20)));
  CHECK(queue.is_over());
  sender.join();
  CHECK_FALSE(queue.push(message_of(10)));
}
