// The page of a map as it is built from src/page.
#pragma once

#include <string_view>

namespace unimapper::apps {

/// HTML with script and style inside; "<!-- data -->" is the place of a map.
[[nodiscard]] std::string_view page_text();

}  // namespace unimapper::apps
