// Suggestion of a known name for a mistyped one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace unimapper::apps {

/// The known name that `typed` is a slip of: at most a third of its letters inserted, left out,
/// exchanged or wrong, letter case ignored, or its beginning. Empty if none is near.
[[nodiscard]] std::string nearest_name(std::string_view typed,
                                       const std::vector<std::string>& known);

/// "; did you mean 'onboard'?" or nothing.
[[nodiscard]] std::string did_you_mean(std::string_view typed,
                                       const std::vector<std::string>& known);

/// "os2-128, livox-avia, ...".
[[nodiscard]] std::string joined(const std::vector<std::string>& names);

}  // namespace unimapper::apps
