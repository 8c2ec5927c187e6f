// Section of times of a report, and the words that sections share.
#include <algorithm>

#include "src/apps/picture/palette.hpp"
#include "src/apps/report/charts.hpp"
#include "src/apps/report/format.hpp"
#include "src/apps/report/page.hpp"
#include "src/apps/report/sections.hpp"

namespace unimapper::apps {
namespace {

std::string load_paragraph(const std::string& of, const std::optional<MeasuredLoad>& load) {
  return "<p class=\"soft\">" + of + ": " + escaped(load ? load_text(*load) : kLoadUnknown) +
         ".</p>\n";
}

/// Charts, and below them the figures of every stage.
std::string robots_times(const Summary& summary) {
  std::string charts;
  std::string loads;
  Table all({"Session", "#p50, ms", "#p99, ms", "#max, ms"});
  Table table({"Session", "Stage", "#p50, ms", "#p99, ms", "#max, ms"});
  bool is_measured = false;
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    const auto& stats = summary.sessions[s].stats;
    if (!stats) continue;
    charts += draw_latency(summary.sessions[s], s);
    if (!stats->stages.empty()) loads += load_paragraph(session_label(summary, s), stats->load);
    for (const StageLatency& stage : stats->stages) {
      is_measured = true;
      table.row({session_label(summary, s), escaped(stage.name), fixed(stage.p50_ms, 2),
                 fixed(stage.p99_ms, 2), fixed(stage.max_ms, 2)});
      if (stage.name != kTotalStage) continue;
      all.row({session_label(summary, s), fixed(stage.p50_ms, 1), fixed(stage.p99_ms, 1),
               fixed(stage.max_ms, 1)});
    }
  }
  std::string html;
  if (!charts.empty()) html += "<div class=\"three\">" + charts + "</div>\n";
  if (!is_measured) return html;
  return html + "<h3>Time per keyframe on the robots</h3>\n" + all.html() + loads +
         "<details><summary>Every stage on the robots, per keyframe</summary>" + table.html() +
         "</details>\n";
}

std::string merge_stages(const ReportInput& input) {
  if (input.result->timing.empty()) return {};
  Table stages({"Stage of the merge", "#Time"});
  for (const merge::StageTime& stage : input.result->timing) {
    stages.row({escaped(stage.stage), duration_text(stage.seconds)});
  }
  return load_paragraph("The merge", input.load) +
         "<details><summary>Every stage of the merge</summary>" + stages.html() + "</details>\n";
}

}  // namespace

std::string session_label(const Summary& summary, std::size_t s) {
  std::string text = "<i class=\"dot\" data-style=\"background:var(--s";
  return text.append(std::to_string(s % kSessionColors.size()))
      .append(")\"></i>")
      .append(escaped(summary.sessions[s].name));
}

std::string duration_text(double seconds) {
  return fixed(seconds, seconds < 10.0 ? 2 : 1) + "\u00a0s";
}

std::string time_section(const ReportInput& input, const Summary& summary) {
  const std::string html = robots_times(summary) + merge_stages(input);
  return html.empty() ? html : "<h2>Time</h2>\n" + html;
}

}  // namespace unimapper::apps
