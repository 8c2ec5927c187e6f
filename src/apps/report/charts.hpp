// Line and bar charts as inline SVG that follows the page's colour scheme.
#pragma once

#include <string>

#include "src/apps/report/summary.hpp"

namespace unimapper::apps {

/// Estimated paths over their ground truth (dashed), seen from above, map frame.
[[nodiscard]] std::string draw_trajectories(const Summary& summary, const ReportInput& input);

/// Translation error over the distance travelled, one line per session.
[[nodiscard]] std::string draw_errors(const Summary& summary);

/// Time per keyframe of one run, with its median and 99th percentile. Empty without a histogram.
[[nodiscard]] std::string draw_latency(const SessionSummary& session, std::size_t index);

}  // namespace unimapper::apps
