// Tests of assertions: misuse of an error's value, assertion handler, trap.
#include "unimapper/core/assert.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csetjmp>
#include <csignal>
#include <type_traits>

#include "tests/test.hpp"
#include "unimapper/core/expected.hpp"

namespace {

using namespace unimapper;

std::jmp_buf back;  // NOLINT: a handler has no other way to reach its test
const char* failed_condition = nullptr;
const char* failed_detail = nullptr;

void remember_and_leave(const char* condition, const char* detail) {
  failed_condition = condition;
  failed_detail = detail;
  std::longjmp(back, 1);
}

/// The signal that ends a process that calls `action`; 0 if it ends by itself.
template <typename Action>
int signal_that_ends(const Action& action) {
  const pid_t child = fork();
  if (child == 0) {
    // The test framework's own handlers would report the signal as a failed test.
    for (const int signal : {SIGILL, SIGTRAP, SIGABRT, SIGSEGV}) std::signal(signal, SIG_DFL);
    action();
    _exit(0);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child) return -1;
  return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

Expected<int> refused() { return Error{ErrorCode::kEmptyScan, "the scan is empty"}; }

}  // namespace

TEST_CASE("the value of an error reaches the assertion handler, with the error's message") {
  failed_condition = failed_detail = nullptr;
  const AssertionHandler before = set_assertion_handler(remember_and_leave);
  if (setjmp(back) == 0) {
    const Expected<int> result = refused();
    const int value = result.value();
    FAIL("a value was returned: " << value);
  }
  CHECK(set_assertion_handler(before) == remember_and_leave);
  REQUIRE(failed_condition != nullptr);
  CHECK(std::string(failed_condition) == "ok()");
  CHECK(std::string(failed_detail) == "the scan is empty");
}

TEST_CASE("without a handler the value of an error ends the program, however it is asked for") {
  CHECK(signal_that_ends([] { (void)refused().error(); }) == 0);
  CHECK(signal_that_ends([] { (void)refused().value(); }) > 0);
  CHECK(signal_that_ends([] { (void)*refused(); }) > 0);
  CHECK(signal_that_ends([] {
          Expected<std::string> text = Error{ErrorCode::kEmptyScan, ""};
          (void)text->size();
        }) > 0);
}

TEST_CASE("the program ends even if the handler returns") {
  CHECK(signal_that_ends([] {
          set_assertion_handler([](const char*, const char*) {});
          (void)refused().value();
        }) > 0);
}

TEST_CASE("a condition that holds is evaluated exactly once") {
  int evaluated = 0;
  UNIMAPPER_ASSERT(++evaluated == 1, "");
  CHECK(evaluated == 1);
}
