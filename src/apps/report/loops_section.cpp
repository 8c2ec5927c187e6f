// Report section on loops.
#include <algorithm>

#include "src/apps/report/format.hpp"
#include "src/apps/report/page.hpp"
#include "src/apps/report/sections.hpp"

namespace unimapper::apps {
namespace {

constexpr std::size_t kMaxListedLoops = 40;

std::string pair_table(const Summary& summary) {
  Table table({"Sessions", "#Accepted", "#Refused"});
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

/// The accepted inter-session loops, the most confident first.
std::string strongest_loops(const ReportInput& input, const Summary& summary) {
  std::vector<const merge::LoopConstraint*> loops;
  for (const merge::LoopConstraint& loop : input.result->loops) {
    if (loop.decision.accepted && !loop.is_intra_session()) loops.push_back(&loop);
  }
  if (loops.empty()) return {};
  std::stable_sort(loops.begin(), loops.end(),
                   [](const auto* a, const auto* b) { return a->confidence > b->confidence; });
  const std::size_t listed = std::min(loops.size(), kMaxListedLoops);
  Table table({"Query", "Match", "Found by", "#Confidence", "#Distance, m", "#Rotation, \u00b0"});
  for (std::size_t i = 0; i < listed; ++i) {
    const merge::LoopConstraint& loop = *loops[i];
    const auto name = [&](KeyframeId id) {
      return escaped(summary.sessions[id.session].name) + " " + std::to_string(id.keyframe);
    };
    const double rotation_deg = rotation_angle(loop.T_match_query.rotation) * kDegreesPerRadian;
    table.row({name(loop.query), name(loop.match), escaped(loop.decision.reason),
               fixed(static_cast<double>(loop.confidence), 2),
               fixed(loop.T_match_query.translation.norm(), 1), fixed(rotation_deg, 0)});
  }
  return "<details><summary>The " + std::to_string(listed) + " most confident of " +
         grouped(loops.size()) + " accepted inter-session loops</summary>" + table.html() +
         "</details>\n";
}

}  // namespace

std::string loops_section(const ReportInput& input, const Summary& summary) {
  if (input.result->loops.empty()) {
    return "<h2>Loops</h2>\n<p>No loop was found, neither intra-session nor inter-session.</p>\n";
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
