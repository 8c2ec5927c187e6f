// Member count of an aggregate, to detect members that a member-wise copy misses.
#pragma once

#include <cstddef>

namespace unimapper::test {

/// Converts to any member.
struct Anything {
  template <typename T>
  operator T() const;  // NOLINT: never called
};

/// Members of the aggregate `T`.
template <typename T, typename... Members>
constexpr std::size_t member_count() {
  if constexpr (requires { T{Members{}..., Anything{}}; }) {
    return member_count<T, Members..., Anything>();
  } else {
    return sizeof...(Members);
  }
}

}  // namespace unimapper::test
