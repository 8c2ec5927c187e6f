// Assembly of the HTML report.
#include "src/apps/report.hpp"

#include <fstream>
#include <stdexcept>

#include "src/apps/report/page.hpp"
#include "src/apps/report/sections.hpp"

namespace unimapper::apps {

void write_report(const std::filesystem::path& path, const ReportInput& input) {
  const Summary summary = summarize(input);
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << page_head(input.title) << headline_section(input, summary) << map_section(input, summary)
      << sessions_section(summary) << accuracy_section(input, summary)
      << loops_section(input, summary) << changes_section(input, summary)
      << unconnected_section(input, summary) << time_section(input, summary)
      << reproduce_section(input) << "</main></body></html>\n";
  out.close();
  if (!out) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace unimapper::apps
