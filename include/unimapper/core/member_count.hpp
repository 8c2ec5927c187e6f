// Number of members of an aggregate, counted by the compiler.
#pragma once

#include <cstddef>

namespace unimapper {

/// Converts to any member.
struct AnyMember {
  template <typename T>
  operator T() const;  // NOLINT: implicit by design, never called
};

/// Members of the aggregate `T`: the most values it can be initialised with.
template <typename T, typename... Members>
consteval std::size_t member_count() {
  if constexpr (requires { T{Members{}..., AnyMember{}}; }) {
    return member_count<T, Members..., AnyMember>();
  } else {
    return sizeof...(Members);
  }
}

}  // namespace unimapper
