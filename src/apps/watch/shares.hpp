// Shares on this computer.
#pragma once

#include <string>
#include <vector>

namespace unimapper::apps {

/// Names under which keyframes are shared, sorted.
[[nodiscard]] std::vector<std::string> list_shares();

}  // namespace unimapper::apps
