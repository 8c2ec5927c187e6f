// Numbers within sentences
#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace unimapper::input {

/// `printf` into a string of at most 511 characters.
[[gnu::format(printf, 1, 2)]] inline std::string text(const char* format, ...) {
  char buffer[512];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

}  // namespace unimapper::input
