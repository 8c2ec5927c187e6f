// Tests of the event ring: empty, single, many, full, wrapped around, two threads at once.
#include "unimapper/core/event_ring.hpp"

#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;

namespace {

class OwnedRing {
 public:
  explicit OwnedRing(std::uint32_t capacity) : block_(EventRing::required_bytes(capacity)) {
    auto created = EventRing::create(capacity, block_.span());
    REQUIRE(created.ok());
    ring_ = created.value();
  }
  EventRing* operator->() const { return ring_; }
  EventRing& operator*() const { return *ring_; }

 private:
  MemoryBlock block_;
  EventRing* ring_ = nullptr;
};

EventRecord numbered(std::int64_t i) { return {1, 0, i, {i, 2 * i, 3 * i, -i}}; }

}  // namespace

TEST_CASE("events come out in the order they went in, however often the ring wraps around") {
  const OwnedRing ring(4);
  EventRecord record;
  CHECK(ring->capacity() == 4);
  CHECK_FALSE(ring->pop(record));
  for (std::int64_t i = 0; i < 100; ++i) {
    REQUIRE(ring->push(numbered(2 * i)));
    REQUIRE(ring->push(numbered(2 * i + 1)));
    for (const std::int64_t expected : {2 * i, 2 * i + 1}) {
      REQUIRE(ring->pop(record));
      REQUIRE(record.stamp_ns == expected);
      REQUIRE(record.values[3] == -expected);
    }
  }
  CHECK_FALSE(ring->pop(record));
  CHECK(ring->overflow() == 0);
}

TEST_CASE("a full event ring keeps what it has and counts what it refuses") {
  const OwnedRing ring(2);
  CHECK(ring->push(numbered(1)));
  CHECK(ring->push(numbered(2)));
  CHECK_FALSE(ring->push(numbered(3)));
  CHECK_FALSE(ring->push(numbered(4)));
  CHECK(ring->overflow() == 2);
  EventRecord record;
  REQUIRE(ring->pop(record));
  CHECK(record.stamp_ns == 1);
  CHECK(ring->push(numbered(5)));
  REQUIRE(ring->pop(record));
  CHECK(record.stamp_ns == 2);
  REQUIRE(ring->pop(record));
  CHECK(record.stamp_ns == 5);
}

TEST_CASE("memory and capacities that will not do are refused by the event ring") {
  alignas(64) std::byte memory[1024];
  CHECK(EventRing::create(3, memory).error().code == ErrorCode::kInvalidConfig);
  CHECK(EventRing::create(0, memory).error().code == ErrorCode::kInvalidConfig);
  CHECK(EventRing::create(1U << 21U, memory).error().code == ErrorCode::kInvalidConfig);
  CHECK(EventRing::create(64, memory).error().code == ErrorCode::kMemoryTooSmall);
  CHECK(EventRing::create(1, {memory + 8, 1000}).error().code == ErrorCode::kMemoryMisaligned);
  CHECK(EventRing::create(4, {memory, EventRing::required_bytes(4)}).ok());
}

TEST_CASE("one thread writes, one reads, nothing is torn, lost or invented") {
  constexpr std::int64_t kEvents = 200000;
  const OwnedRing ring(64);
  std::uint32_t refused = 0;
  std::thread producer([&] {
    for (std::int64_t i = 1; i <= kEvents; ++i) refused += ring->push(numbered(i)) ? 0 : 1;
    while (!ring->push({2, 0, 0, {}})) std::this_thread::yield();
  });
  std::int64_t last = 0;
  std::int64_t read = 0;
  bool intact = true;
  EventRecord record;
  while (true) {
    if (!ring->pop(record)) {
      std::this_thread::yield();
      continue;
    }
    if (record.id == 2) break;
    const std::int64_t i = record.stamp_ns;
    intact = intact && i > last && record.values[0] == i && record.values[1] == 2 * i &&
             record.values[2] == 3 * i && record.values[3] == -i;
    last = i;
    ++read;
  }
  producer.join();
  CHECK(intact);
  CHECK(read + refused == kEvents);
  CHECK(ring->overflow() >= refused);
}
