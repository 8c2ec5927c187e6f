// Sections of a report.
#include "src/apps/report/sections.hpp"

#include <algorithm>
#include <cmath>

#include "src/apps/picture/palette.hpp"
#include "src/apps/report/charts.hpp"
#include "src/apps/report/format.hpp"
#include "src/apps/report/page.hpp"
#include "src/apps/report/waiting_pairs.hpp"

namespace unimapper::apps {
namespace {

using merge::SessionStatus;

std::string tile(const std::string& figure, const std::string& meaning) {
  std::string text = "<div class=\"tile\"><b>";
  return text.append(figure).append("</b><span>").append(meaning).append("</span></div>\n");
}

std::string plural(std::size_t count, const std::string& one) {
  return grouped(count) + ' ' + one + (count == 1 ? "" : "s");
}

std::string status_label(SessionStatus status) {
  if (status == SessionStatus::kCentral) return "<b>central</b>";
  if (status == SessionStatus::kMerged) return "<span class=\"good\">merged</span>";
  if (status == SessionStatus::kProvisional) return "<span class=\"bad\">provisional</span>";
  return "<span class=\"bad\">unconnected</span>";
}

/// Zero is shown without emphasis.
std::string losses(std::uint64_t missing, std::uint64_t damaged) {
  if (missing + damaged == 0) return "<span class=\"soft\">0</span>";
  return "<span class=\"warn\">" + grouped(missing) + " / " + grouped(damaged) + "</span>";
}

bool has_removal(const ReportInput& input) {
  return std::any_of(input.references.begin(), input.references.end(),
                     [](const SessionReference& e) { return e.removal.has_value(); });
}

std::string accuracy_table(const ReportInput& input, const Summary& summary, bool removal) {
  std::vector<std::string> titles = {"Session"};
  if (summary.has_truth) {
    titles.insert(titles.end(), {"#ATE rmse, m", "#mean, m", "#max, m", "#rotation rmse, \u00b0"});
  }
  if (removal) titles.insert(titles.end(), {"#SA, %", "#DA, %", "#AA, %", "#all dynamic, %"});
  Table table(titles);
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    std::vector<std::string> cells = {session_label(summary, s)};
    if (summary.has_truth) {
      const double none = std::nan("");
      const auto& error = summary.sessions[s].error;
      cells.push_back(fixed(error ? error->translation_m.rmse : none, 3));
      cells.push_back(fixed(error ? error->translation_m.mean : none, 3));
      cells.push_back(fixed(error ? error->translation_m.max : none, 3));
      cells.push_back(fixed(error ? error->rotation_deg.rmse : none, 2));
    }
    if (removal) {
      const RemovalScore score = input.references[s].removal.value_or(RemovalScore{});
      cells.push_back(percent(score.moving.static_accuracy(), 2));
      cells.push_back(percent(score.moving.dynamic_accuracy(), 2));
      cells.push_back(percent(score.moving.associated_accuracy(), 2));
      cells.push_back("<span class=\"soft\">" + percent(score.all.dynamic_accuracy(), 2) +
                      "</span>");
    }
    table.row(cells);
  }
  return table.html();
}

/// What was unusual about the recordings, above everything else.
std::string input_warnings(const Summary& summary) {
  std::string html;
  for (const SessionSummary& session : summary.sessions) {
    if (!session.stats) continue;
    for (const std::string& warning : session.stats->input_warnings) {
      html += "<p class=\"warn\">Input of <b>" + escaped(session.name) +
              "</b>: " + escaped(warning) + "</p>\n";
    }
  }
  return html;
}

}  // namespace

std::string headline_section(const ReportInput& input, const Summary& summary) {
  const std::size_t all = summary.sessions.size();
  std::string html = "<h1>" + escaped(input.title) + "</h1>\n<p class=\"lead\">";
  if (summary.merged_sessions == all && all > 1) {
    html += "All " + plural(all, "session") + " share one frame";
  } else if (summary.merged_sessions > 1) {
    html += std::to_string(summary.merged_sessions) + " of " + plural(all, "session") +
            " share one frame, " + std::to_string(all - summary.merged_sessions) + " unconnected";
  } else {
    html += plural(all, "session") + ", none merged with another";
  }
  if (!summary.sessions.empty()) {
    const std::size_t central = std::min(input.result->central_session, all - 1);
    html += "; the frame is that of <b>" + escaped(summary.sessions[central].name) + "</b>";
  }
  html += ".</p>\n" + input_warnings(summary) + "<div class=\"tiles\">\n";
  std::size_t keyframes = 0;
  double points_in = 0.0;
  double points_dynamic = 0.0;
  double path_m = 0.0;
  double worst_m = 0.0;
  for (const SessionSummary& session : summary.sessions) {
    keyframes += session.keyframes;
    points_in += static_cast<double>(session.points_in);
    points_dynamic += session.dynamic_share * static_cast<double>(session.points_in);
    path_m += session.path_m;
    if (session.error) worst_m = std::max(worst_m, session.error->translation_m.rmse);
  }
  html += tile(std::to_string(summary.merged_sessions) + " / " + std::to_string(all),
               "sessions in one map");
  html += tile(grouped(keyframes), "keyframes over " + length(path_m));
  html += tile(short_count(input.result->map.size()), "points in the static map");
  html += tile(percent(points_in > 0.0 ? points_dynamic / points_in : 0.0, 1) + "\u00a0%",
               "of all points removed as dynamic");
  html += tile(grouped(summary.inter.accepted) + " + " + grouped(summary.intra.accepted),
               "inter-session + intra-session loops accepted");
  if (summary.has_truth) html += tile(length(worst_m), "largest ATE rmse of a session");
  if (input.elapsed_s > 0.0) html += tile(duration_text(input.elapsed_s), "to merge");
  return html + "</div>\n";
}

std::string sessions_section(const Summary& summary) {
  Table table({"Session", "Sensor", "Status", "#Keyframes", "#Missing / damaged", "#Path, m",
               "#Points in, M", "#Removed as dynamic, %"});
  bool complete = true;
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    const SessionSummary& session = summary.sessions[s];
    complete = complete && session.complete;
    table.row(
        {session_label(summary, s), escaped(session.sensor.empty() ? "\u2013" : session.sensor),
         status_label(session.status),
         grouped(session.keyframes) + (session.complete ? "" : "<span class=\"warn\">+?</span>"),
         losses(session.missing, session.damaged),
         fixed(session.path_m, session.path_m < 100.0 ? 1 : 0),
         fixed(static_cast<double>(session.points_in) * 1e-6, 1),
         percent(session.dynamic_share, 1)});
  }
  std::string html = "<h2>Sessions</h2>\n" + table.html();
  for (const SessionSummary& session : summary.sessions) {
    if (!merge::is_in_map(session.status) || session.reason.empty()) continue;
    html += "<p class=\"bad\">" + escaped(session.name + ": " + session.reason) + "</p>\n";
  }
  if (!complete) {
    html +=
        "<p class=\"soft\"><span class=\"warn\">+?</span>: the end of the session never "
        "arrived, so there may have been more keyframes.</p>\n";
  }
  return html;
}

std::string accuracy_section(const ReportInput& input, const Summary& summary) {
  const bool removal = has_removal(input);
  if (!summary.has_truth && !removal) return {};
  std::string html = "<h2>Against ground truth</h2>\n" + accuracy_table(input, summary, removal);
  if (removal) {
    html +=
        "<p class=\"soft\">SA: share of static points kept. DA: share of points removed of objects "
        "that moved while they were seen. Both per point, by the robot's online labels; AA is "
        "their "
        "geometric mean. <i>All dynamic</i> also counts what never moved while it was seen, such "
        "as "
        "a bus at its stop: nothing in the scans tells it from a parked one.</p>\n";
  }
  if (!summary.has_truth) return html;
  std::vector<std::pair<std::string, std::string>> entries;
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    if (!summary.sessions[s].error) continue;
    entries.emplace_back("var(--s" + std::to_string(s % kSessionColors.size()) + ')',
                         summary.sessions[s].name);
  }
  entries.emplace_back("var(--ink)", "ground truth (dashed)");
  return html +
         "<p class=\"soft\">The frame of the central session is aligned to its ground truth once; "
         "no other session is aligned on its own, so errors include those of the merge.</p>\n<div "
         "class=\"pair\">" +
         draw_trajectories(summary, input) + draw_errors(summary) + "</div>\n" + legend(entries);
}

std::string changes_section(const ReportInput& input, const Summary& summary) {
  if (summary.merged_sessions < 2) return {};
  const auto& changes = input.result->changes;
  const auto appeared = static_cast<std::size_t>(std::count_if(
      changes.begin(), changes.end(), [](const merge::ChangedPoint& c) { return c.appeared; }));
  const auto objects = [&](ChangeKind kind) {
    const auto& all = input.result->changed_objects;
    return static_cast<std::size_t>(std::count_if(
        all.begin(), all.end(), [kind](const auto& object) { return object.kind == kind; }));
  };
  const std::string counts = plural(objects(ChangeKind::kAppeared), "object") + " appeared, " +
                             std::to_string(objects(ChangeKind::kGone)) + " gone, " +
                             std::to_string(objects(ChangeKind::kMoved)) + " moved";
  return "<h2>Changes between sessions</h2>\n<p>" + counts + ": " + plural(appeared, "point") +
         " appeared, " + plural(changes.size() - appeared, "point") +
         " gone. Their boxes are in <code>changes.json</code>.</p>\n";
}

/// Pairs that wait: what to look at, and the commands that decide it.
std::string waiting_section(const ReportInput& input) {
  std::string html;
  for (const WaitingPair& pair : waiting_pairs(*input.sessions, *input.result)) {
    html +=
        "<p>" + escaped(pair.sentence) +
        " The page shows both scans over each other where that loop is chosen. In a project one "
        "of these decides it with the next merge:</p>\n<pre>";
    const std::string& query = (*input.sessions)[pair.query].info.name;
    for (const std::string& command : deciding_commands(pair, query, "STORE")) {
      html += escaped(command) + '\n';
    }
    html += "</pre>\n";
  }
  return html;
}

std::string unconnected_section(const ReportInput& input, const Summary& summary) {
  std::string html;
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    const SessionSummary& session = summary.sessions[s];
    if (merge::is_in_map(session.status)) continue;
    html += "<h3>" + session_label(summary, s) + "</h3>\n<p>" +
            (session.reason.empty() ? "No loop connects it to the map." : escaped(session.reason)) +
            "</p>\n";
  }
  if (html.empty()) return html;
  return "<h2>Sessions apart</h2>\n<p>A session that no consistent set of loops connects stays in "
         "its own frame; so does a provisional one, whose loops something else would explain as "
         "well.</p>\n" +
         html + waiting_section(input);
}

std::string reproduce_section(const ReportInput& input) {
  std::string html =
      "<h2>Beside this page</h2>\n<p><code>map.ply</code> the static map, <code>changes.ply</code> "
      "what changed, <code>removed.ply</code> what was removed, <code>clouds/</code> every "
      "session's own cloud, <code>trajectories/</code> "
      "one TUM file per session, <code>graph.g2o</code> the pose graph, <code>loops.csv</code> "
      "every loop and why it was refused, <code>summary.json</code> the figures.</p>\n";
  if (input.commands.empty()) return html;
  html += "<h2>How to reproduce</h2>\n<pre>";
  for (const std::string& command : input.commands) html += escaped(command) + '\n';
  return html + "</pre>\n";
}

}  // namespace unimapper::apps
