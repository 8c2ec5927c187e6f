// Assertion of preconditions, with a replaceable failure handler.
#pragma once

namespace unimapper {

/// What an assertion that fails calls: `condition` is what should have held, `detail` says more (an
/// error's message) or is empty. Both are static strings. A handler should not return; where one
/// does, the processor's trap instruction follows all the same.
using AssertionHandler = void (*)(const char* condition, const char* detail);

/// Replaces the handler and returns the one before. Firmware sets one that logs and resets; null
/// restores the default, which only traps. Applies to all threads; set it before the first runs.
AssertionHandler set_assertion_handler(AssertionHandler handler) noexcept;

/// Calls the handler, then traps. Never returns.
[[noreturn]] void fail_assertion(const char* condition, const char* detail) noexcept;

}  // namespace unimapper

/// Stops the program loudly, in release builds too, unless `condition` holds: for misuse that must
/// not go on with a value that was never computed. Cost: one comparison.
#define UNIMAPPER_ASSERT(condition, detail) \
  ((condition) ? static_cast<void>(0) : ::unimapper::fail_assertion(#condition, (detail)))
