// Tests of Expected.
#include "unimapper/core/expected.hpp"

#include "tests/test.hpp"

using namespace unimapper;

TEST_CASE("a value is a value, and can be moved out") {
  Expected<std::string> result = std::string("long enough to live on the heap, surely");
  CHECK(result.ok());
  CHECK(static_cast<bool>(result));
  CHECK((*result).size() == 39);
  CHECK(result->size() == 39);
  CHECK(result.error().code == ErrorCode::kOk);
  const std::string moved = std::move(result.value());
  CHECK(moved.size() == 39);
}

TEST_CASE("an error says why") {
  const Expected<int> result = Error{ErrorCode::kEmptyScan, "the scan is empty"};
  CHECK_FALSE(result.ok());
  CHECK_FALSE(static_cast<bool>(result));
  CHECK_FALSE(result.error().ok());
  CHECK(result.error().code == ErrorCode::kEmptyScan);
  CHECK(std::string(result.error().message) == "the scan is empty");
}
