#include "unimapper/core/assert.hpp"

#include <atomic>

namespace unimapper {
namespace {

std::atomic<AssertionHandler> current_handler{nullptr};

}  // namespace

AssertionHandler set_assertion_handler(AssertionHandler handler) noexcept {
  const AssertionHandler before = current_handler.load(std::memory_order_relaxed);
  current_handler.store(handler, std::memory_order_release);
  return before;
}

void fail_assertion(const char* condition, const char* detail) noexcept {
  if (const AssertionHandler handler = current_handler.load(std::memory_order_acquire)) {
    handler(condition, detail);
  }
  __builtin_trap();
}

}  // namespace unimapper
