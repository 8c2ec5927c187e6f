// Lines on standard error.
#pragma once

#include <iostream>
#include <string>

namespace unimapper::apps {

/// From any thread, a line at a time.
inline void say(const std::string& text) { std::cerr << "unimapper: " + text + "\n" << std::flush; }

}  // namespace unimapper::apps
