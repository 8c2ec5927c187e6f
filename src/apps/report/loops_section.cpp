#include <algorithm>

#include "src/apps/report/format.hpp"
#include "src/apps/report/page.hpp"
#include "src/apps/report/sections.hpp"

namespace unimapper::apps {
namespace {

constexpr std::size_t kMaxListedLoops = 40;

std::string pair_table(const Summary& summary) {
  Table table({"Between", "#Accepted", "#Refused"});
  for (const auto& [pair, count] : summary.loops_by_pair) {
    const std::string& first = summary.sessions[pair.first].name;
    const std::string& second = summary.sessions[pair.second].name;
    const std::string name = pair.first == pair.second
                                 ? "within " + escaped(first)
                                 : escaped(first) + " \u2194 " + escaped(second);
    table.row(
        {name,
         count.accepted > 0 ? "<span class=\"good\">" + grouped(count.accepted) + "</span>" : "0",
         grouped(count.refused)});
  }
  return table.html();
}

std::string reason_table(const std::string& title,
                         const std::map<std::string, std::size_t>& reasons) {
  std::vector<std::pair<std::string, std::size_t>> rows(reasons.begin(), reasons.end());
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  Table table({title, "#Loops"});
  for (const auto& [reason, count] : rows) table.row({escaped(reason), grouped(count)});
  return table.html();
}

/// The accepted loops between sessions, the most confident first.
std::string strongest_loops(const ReportInput& input, const Summary& summary) {
  std::vector<const merge::LoopRecord*> loops;
  for (const merge::LoopRecord& loop : input.result->loops) {
    if (loop.accepted && loop.query_session != loop.match_session) loops.push_back(&loop);
  }
  if (loops.empty()) return {};
  std::stable_sort(loops.begin(), loops.end(),
                   [](const auto* a, const auto* b) { return a->confidence > b->confidence; });
  const std::size_t listed = std::min(loops.size(), kMaxListedLoops);
  Table table({"Query", "Match", "Found by", "#Confidence", "#Distance, m", "#Turned, \u00b0"});
  for (std::size_t i = 0; i < listed; ++i) {
    const merge::LoopRecord& loop = *loops[i];
    const auto name = [&](std::size_t session, std::size_t keyframe) {
      return escaped(summary.sessions[session].name) + " " + std::to_string(keyframe);
    };
    const double turned = rotation_angle(loop.T_match_query_keyframe.rotation) * 57.29577951;
    table.row({name(loop.query_session, loop.query_keyframe),
               name(loop.match_session, loop.match_keyframe), escaped(loop.reason),
               fixed(static_cast<double>(loop.confidence), 2),
               fixed(loop.T_match_query_keyframe.translation.norm(), 1), fixed(turned, 0)});
  }
  return "<details><summary>The " + std::to_string(listed) + " most confident of " +
         grouped(loops.size()) + " accepted loops between sessions</summary>" + table.html() +
         "</details>\n";
}

}  // namespace

std::string loops_section(const ReportInput& input, const Summary& summary) {
  if (input.result->loops.empty()) {
    return "<h2>Loops</h2>\n<p>No loop was found, neither within nor between sessions.</p>\n";
  }
  std::string right;
  if (!summary.acceptance_ways.empty()) {
    right += reason_table("Accepted, found by", summary.acceptance_ways);
  }
  if (!summary.refusals.empty()) right += reason_table("Refused because", summary.refusals);
  return "<h2>Loops</h2>\n<div class=\"pair\"><div>" + pair_table(summary) + "</div><div>" + right +
         "</div></div>\n" + strongest_loops(input, summary);
}

}  // namespace unimapper::apps
