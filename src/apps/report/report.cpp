// Assembly of the HTML report.
#include "src/apps/report.hpp"

#include <fstream>
#include <stdexcept>

#include "src/apps/report/map_picture.hpp"
#include "src/apps/report/page.hpp"
#include "src/apps/report/sections.hpp"

namespace unimapper::apps {

namespace {

/// Of points and keyframes as text: the demo's report stays below 6 MB. The page itself takes 0.7
/// MB, as do the map's JSON with the picture, and points of an evaluation (`evaluate view`).
constexpr std::uint64_t kPointBytes = 3'200'000;

}  // namespace

void write_report(const std::filesystem::path& path, const ReportInput& input,
                  const MapFiles& files) {
  const Summary summary = summarize(input);
  const std::string sections =
      report_style() + "<main>\n" + headline_section(input, summary) + sessions_section(summary) +
      accuracy_section(input, summary) + loops_section(input, summary) +
      quality_section(*input.sessions, input.qualities) + changes_section(input, summary) +
      unconnected_section(input, summary) + time_section(input, summary) +
      reproduce_section(input) + "</main>";
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << page_with(files, kPointBytes, {sections, draw_map(input)});
  out.close();
  if (!out) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace unimapper::apps
