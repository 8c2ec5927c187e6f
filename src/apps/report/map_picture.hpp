// Top view of a merged map: an SVG drawing with the points as an embedded PNG.
#pragma once

#include <cstddef>
#include <string>

#include "src/apps/report.hpp"

namespace unimapper::apps {

/// The map in the sessions' colours, removed dynamic points in red, the paths, and the loops:
/// accepted ones green, refused ones grey and dashed.
[[nodiscard]] std::string draw_map(const ReportInput& input);

}  // namespace unimapper::apps
