// Sections of a report, top to bottom.
#pragma once

#include <string>

#include "src/apps/report/summary.hpp"

namespace unimapper::apps {

// Each returns HTML, empty where a section has no content.

[[nodiscard]] std::string headline_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string map_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string sessions_section(const Summary& summary);
[[nodiscard]] std::string accuracy_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string loops_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string changes_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string unconnected_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string time_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string reproduce_section(const ReportInput& input);

}  // namespace unimapper::apps
