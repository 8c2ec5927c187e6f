// HTML elements of a report.
#include "src/apps/report/page.hpp"

#include "src/apps/report/format.hpp"

namespace unimapper::apps {
namespace {

// Session colours come twice: the pictures' own on dark, deeper ones on paper.
constexpr const char* kStyle = R"(
:host{--paper:#fbfbfa;--card:#fff;--ink:#1b1f24;--soft:#5d6673;--line:#dfe2e6;--good:#0b7a3b;
--bad:#c02b31;--warn:#96630a;--s0:#1f6fd0;--s1:#c97a05;--s2:#7d4fd6;--s3:#0b8f8d;--s4:#c8418c;
--s5:#85850f;--s6:#94683a;--s7:#566389;color-scheme:light dark}
@media(prefers-color-scheme:dark){:host{--paper:#0f1319;--card:#161b22;--ink:#e7eaee;
--soft:#98a2b0;--line:#2a313b;--good:#4fd681;--bad:#ff7076;--warn:#f0b64e;--s0:#59a6ff;
--s1:#ffb040;--s2:#b88cff;--s3:#40d6d1;--s4:#ff8ccc;--s5:#dbdb5c;--s6:#cc9e75;--s7:#8c9ecc}}
*{box-sizing:border-box}
:host{display:block;background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans","DejaVu Sans",sans-serif}
main{max-width:1180px;margin:0 auto;padding:36px 24px 64px}
h1{font-size:2rem;line-height:1.2;margin:0 0 4px;letter-spacing:-.01em}
h2{font-size:1.3rem;margin:48px 0 12px;letter-spacing:-.01em}
h3{font-size:1rem;margin:20px 0 6px}
p{margin:0 0 12px;max-width:75ch}
.lead{color:var(--soft);font-size:1.06rem}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:12px;
margin:22px 0 0}
.tile{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:12px 16px}
.tile b{display:block;font-size:1.55rem;font-weight:650;line-height:1.25;
font-variant-numeric:tabular-nums}
.tile span{color:var(--soft);font-size:.88rem}
figure{margin:0 0 10px}
svg{display:block;width:100%;height:auto}
.chart{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:6px}
.chart text{font-size:12px;fill:var(--soft);font-variant-numeric:tabular-nums}
.chart .title text{fill:var(--ink);font-size:12.5px}
.chart .count{font-size:10.5px}
.chart .grid path{stroke:var(--line);stroke-width:1;fill:none}
figcaption,.legend{color:var(--soft);font-size:.9rem}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;margin:8px 0 4px;padding:0;list-style:none}
.legend i{display:inline-block;width:.85em;height:.85em;border-radius:3px;margin-right:.45em;
vertical-align:-.06em;border:1px solid #0003}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,420px),1fr));gap:16px;
align-items:start}
.three{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,330px),1fr));gap:16px}
.scroll{overflow-x:auto;margin:0 0 10px}
table{border-collapse:collapse;width:100%;font-size:.94rem;background:var(--card);
border:1px solid var(--line);border-radius:10px}
th,td{padding:7px 14px;text-align:left;border-bottom:1px solid var(--line);vertical-align:top}
tr:last-child td{border-bottom:0}
th{font-weight:600;color:var(--soft);font-size:.85rem;vertical-align:bottom}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.good{color:var(--good)}.bad{color:var(--bad)}.warn{color:var(--warn)}.soft{color:var(--soft)}
.dot{display:inline-block;width:.7em;height:.7em;border-radius:50%;margin-right:.5em}
pre{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:14px 16px;
overflow-x:auto;font:13.5px/1.55 ui-monospace,"DejaVu Sans Mono",monospace;white-space:pre-wrap;
overflow-wrap:anywhere}
code{font-family:ui-monospace,"DejaVu Sans Mono",monospace;font-size:.92em}
details{margin:10px 0}summary{cursor:pointer;color:var(--soft)}
details>*:not(summary){margin-top:8px}
)";

}  // namespace

Table::Table(const std::vector<std::string>& titles) {
  for (const std::string& title : titles) {
    const bool figure = !title.empty() && title.front() == '#';
    figures_.push_back(figure);
    head_ += figure ? "<th class=\"n\">" : "<th>";
    head_.append(title, figure ? 1 : 0).append("</th>");
  }
}

void Table::row(const std::vector<std::string>& cells) {
  body_ += "<tr>";
  for (std::size_t c = 0; c < cells.size() && c < figures_.size(); ++c) {
    body_ += figures_[c] ? "<td class=\"n\">" : "<td>";
    body_.append(cells[c]).append("</td>");
  }
  body_ += "</tr>\n";
}

std::string Table::html() const {
  std::string text = "<div class=\"scroll\"><table><thead><tr>";
  return text.append(head_)
      .append("</tr></thead><tbody>")
      .append(body_)
      .append("</tbody></table></div>\n");
}

std::string legend(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string text = "<ul class=\"legend\">";
  for (const auto& [color, meaning] : entries) {
    text += "<li><i data-style=\"background:";
    text.append(color).append("\"></i>").append(escaped(meaning)).append("</li>");
  }
  return text.append("</ul>\n");
}

std::string report_style() { return std::string("<style>").append(kStyle).append("</style>"); }

}  // namespace unimapper::apps
