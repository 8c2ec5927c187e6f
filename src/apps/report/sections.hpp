// Sections of a report, top to bottom.
#pragma once

#include <string>

#include "src/apps/report/summary.hpp"

namespace unimapper::apps {

// Each returns HTML, empty where a section has no content.

[[nodiscard]] std::string headline_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string sessions_section(const Summary& summary);
[[nodiscard]] std::string accuracy_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string loops_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string changes_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string unconnected_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string time_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string reproduce_section(const ReportInput& input);

/// Name of a session behind a dot of its colour.
[[nodiscard]] std::string session_label(const Summary& summary, std::size_t s);
/// "12.3 s".
[[nodiscard]] std::string duration_text(double seconds);

}  // namespace unimapper::apps
