// Tests of the queue before a delivery.
#include "ports/delivery/hand_over.hpp"

#include <latch>

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::delivery;

TEST_CASE("what is put in is handed on in order, the last of it at the end") {
  std::vector<std::vector<std::uint8_t>> taken;
  std::vector<std::int64_t> stamps;
  HandOver queue(3, 8, [&](wire::Bytes bytes, std::int64_t stamp_ns) {
    taken.emplace_back(bytes.begin(), bytes.end());
    stamps.push_back(stamp_ns);
  });
  for (std::uint8_t i = 0; i < 100; ++i) {
    const std::vector<std::uint8_t> bytes(1 + i % 8, i);
    while (!queue.put(bytes, i)) std::this_thread::yield();
  }
  queue.finish();
  REQUIRE(taken.size() == 100);
  for (std::uint8_t i = 0; i < 100; ++i) {
    CHECK(taken[i] == std::vector<std::uint8_t>(1 + i % 8, i));
    CHECK(stamps[i] == i);
  }
  CHECK(queue.failed() == 0);
}

TEST_CASE("what finds no slot, or is larger than one, is refused at once") {
  std::latch go_on(1);
  std::size_t taken = 0;
  HandOver queue(2, 4, [&](wire::Bytes /*bytes*/, std::int64_t /*stamp_ns*/) {
    go_on.wait();
    ++taken;
  });
  const std::vector<std::uint8_t> bytes(5);
  CHECK_FALSE(queue.put(bytes, 1));
  CHECK(queue.put(wire::Bytes(bytes).first(4), 2));
  CHECK(queue.put(wire::Bytes(bytes).first(4), 3));
  CHECK_FALSE(queue.put(wire::Bytes(bytes).first(4), 4));
  go_on.count_down();
  queue.finish();
  CHECK(taken == 2);
}

TEST_CASE("a keyframe that cannot be taken is counted, and the next one is") {
  std::size_t taken = 0;
  HandOver queue(4, 4, [&](wire::Bytes bytes, std::int64_t /*stamp_ns*/) {
    if (bytes[0] == 1) throw std::runtime_error("not this one");
    ++taken;
  });
  for (std::uint8_t mark = 0; mark < 3; ++mark) CHECK(queue.put({&mark, 1}, 0));
  queue.finish();
  CHECK(taken == 2);
  CHECK(queue.failed() == 1);
}
