// Top views of a merged map: SVG figures with the points as an embedded PNG.
#pragma once

#include <cstddef>
#include <string>

#include "src/apps/report.hpp"

namespace unimapper::apps {

/// The map in the sessions' colours, removed dynamic points in red, the paths, and the loops:
/// accepted ones green, refused ones grey and dashed.
[[nodiscard]] std::string draw_map(const ReportInput& input);

/// The map in grey, what appeared between sessions in green, what is gone in red.
[[nodiscard]] std::string draw_changes(const ReportInput& input);

/// One unconnected session, in its own frame.
[[nodiscard]] std::string draw_session(const ReportInput& input, std::size_t session);

}  // namespace unimapper::apps
