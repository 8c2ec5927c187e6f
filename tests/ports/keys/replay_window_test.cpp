// Tests of the replay window: every number once, in almost any order.
#include "ports/keys/replay_window.hpp"

#include "tests/random.hpp"
#include "tests/test.hpp"

using unimapper::keys::ReplayWindow;

TEST_CASE("every number is new once, in whatever order it comes") {
  unimapper::test::Random random(1);
  std::vector<std::uint64_t> numbers(3000);
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
  for (std::size_t i = numbers.size(); i > 1; --i) {
    std::swap(numbers[i - 1], numbers[random.below(static_cast<std::uint32_t>(i))]);
  }
  ReplayWindow window;
  for (const std::uint64_t number : numbers) {
    if (!window.insert(number)) FAIL("new: " << number);
  }
  for (const std::uint64_t number : numbers) {
    if (window.insert(number)) FAIL("again: " << number);
  }
}

TEST_CASE("a number that lies too far back counts as old") {
  ReplayWindow window;
  CHECK(window.insert(ReplayWindow::kWidth));
  CHECK(window.insert(1));
  CHECK_FALSE(window.insert(0));
  CHECK(window.insert(UINT64_MAX));
  CHECK_FALSE(window.insert(UINT64_MAX));
  CHECK_FALSE(window.insert(ReplayWindow::kWidth + 1));
  CHECK(window.insert(UINT64_MAX - ReplayWindow::kWidth + 1));
  CHECK_FALSE(window.insert(UINT64_MAX - ReplayWindow::kWidth));
}
