// Terminal summary of a merge.
#include <algorithm>
#include <array>

#include "src/apps/report.hpp"
#include "src/apps/report/format.hpp"
#include "src/apps/report/summary.hpp"

namespace unimapper::apps {
namespace {

/// Characters a terminal shows for UTF-8 text without wide ones.
std::size_t columns(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

/// Left-aligned first columns, right-aligned figures, two blanks between.
class TextTable {
 public:
  explicit TextTable(std::size_t text_columns) : text_columns_(text_columns) {}
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }

  [[nodiscard]] std::string text() const {
    std::vector<std::size_t> widths;
    for (const auto& cells : rows_) {
      widths.resize(std::max(widths.size(), cells.size()));
      for (std::size_t c = 0; c < cells.size(); ++c) {
        widths[c] = std::max(widths[c], columns(cells[c]));
      }
    }
    std::string out;
    for (const auto& cells : rows_) {
      std::string line;
      for (std::size_t c = 0; c < cells.size(); ++c) {
        const std::string gap(widths[c] - columns(cells[c]), ' ');
        line.append(c < text_columns_ ? cells[c] + gap : gap + cells[c]).append("  ");
      }
      line.erase(line.find_last_not_of(' ') + 1);
      out.append(line).append("\n");
    }
    return out;
  }

 private:
  std::size_t text_columns_;
  std::vector<std::vector<std::string>> rows_;
};

std::string loop_line(const Summary& summary) {
  std::string line = "loops: ";
  line += std::to_string(summary.inter.accepted) + " inter-session and " +
          std::to_string(summary.intra.accepted) + " intra-session accepted, " +
          std::to_string(summary.inter.refused + summary.intra.refused) + " refused\n";
  return line;
}

}  // namespace

std::string summary_table(const ReportInput& input) {
  const Summary summary = summarize(input);
  const bool removal = std::any_of(input.references.begin(), input.references.end(),
                                   [](const SessionReference& e) { return e.removal.has_value(); });
  TextTable table(3);
  std::vector<std::string> head = {"session", "sensor", "status",   "keyframes",
                                   "lost",    "path m", "dynamic %"};
  if (summary.has_truth) head.insert(head.end(), {"ATE rmse m", "ATE max m"});
  if (removal) head.insert(head.end(), {"SA %", "DA %", "all dyn. %"});
  table.row(head);
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    const SessionSummary& session = summary.sessions[s];
    std::vector<std::string> cells = {session.name,
                                      session.sensor.empty() ? "-" : session.sensor,
                                      merge::status_name(session.status),
                                      std::to_string(session.keyframes),
                                      std::to_string(session.missing + session.damaged),
                                      fixed(session.path_m, 1),
                                      percent(session.dynamic_share, 1)};
    if (summary.has_truth) {
      cells.push_back(session.error ? fixed(session.error->translation_m.rmse, 3) : "-");
      cells.push_back(session.error ? fixed(session.error->translation_m.max, 3) : "-");
    }
    if (removal) {
      const auto& score = input.references[s].removal;
      cells.push_back(score ? percent(score->moving.static_accuracy(), 2) : "-");
      cells.push_back(score ? percent(score->moving.dynamic_accuracy(), 2) : "-");
      cells.push_back(score ? percent(score->all.dynamic_accuracy(), 2) : "-");
    }
    table.row(cells);
  }
  std::string text = "\n" + table.text() + loop_line(summary);
  text += "map: " + std::to_string(input.result->map.size()) + " points, " +
          std::to_string(summary.merged_sessions) + " of " +
          std::to_string(summary.sessions.size()) + " sessions in one frame\n";
  text += quality_lines(*input.sessions, input.qualities);
  for (const SessionSummary& session : summary.sessions) {
    if (session.up_known == session.keyframes) continue;
    text += session.name + ": up is unknown in " +
            std::to_string(session.keyframes - session.up_known) + " of " +
            std::to_string(session.keyframes) + " keyframes, nothing tells how level they are\n";
  }
  for (const SessionSummary& session : summary.sessions) {
    if (session.odometry_contradicted == 0) continue;
    text += session.name + ": warning: scans contradict the odometry in " +
            std::to_string(session.odometry_contradicted) + " of " +
            std::to_string(session.keyframes) +
            " keyframes: it may have jumped, or the robot was carried\n";
  }
  for (const SessionSummary& session : summary.sessions) {
    if (session.reason.empty()) continue;
    const char* outcome = merge::is_in_map(session.status) ? "" : " is not connected";
    text += session.name + outcome + ": " + session.reason + "\n";
  }
  return text;
}

}  // namespace unimapper::apps
