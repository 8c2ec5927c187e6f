// Formatted text on a standard stream.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace unimapper::apps {

/// Unlike `fmt::print` it does not throw where the stream cannot be written: mapping goes on.
template <typename... Values>
void print_to(std::FILE* stream, fmt::format_string<Values...> format, Values&&... values) {
  std::fputs(fmt::format(format, std::forward<Values>(values)...).c_str(), stream);
}

}  // namespace unimapper::apps
