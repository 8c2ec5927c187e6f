// The sections of a report, top to bottom. Each returns HTML, empty when there is nothing to say.
#pragma once

#include <string>

#include "src/apps/report/summary.hpp"

namespace unimapper::apps {

[[nodiscard]] std::string headline_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string map_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string sessions_section(const Summary& summary);
[[nodiscard]] std::string accuracy_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string loops_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string changes_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string apart_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string time_section(const ReportInput& input, const Summary& summary);
[[nodiscard]] std::string reproduce_section(const ReportInput& input);

}  // namespace unimapper::apps
