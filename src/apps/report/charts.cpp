// Line and bar charts as inline SVG.
#include "src/apps/report/charts.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "src/apps/picture/palette.hpp"
#include "src/apps/report/format.hpp"

namespace unimapper::apps {
namespace {

using Points = std::vector<Eigen::Vector2d>;

/// A step of 1, 2 or 5 times a power of ten that cuts `range` into about `parts`.
double round_step(double range, double parts) {
  const double raw = std::max(range, 1e-9) / parts;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw) return factor * power;
  }
  return 10.0 * power;
}

std::string tick(double value, double step) {
  const int digits = step >= 1.0 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9));
  return fixed(value == 0.0 ? 0.0 : value, std::clamp(digits, 0, 4));
}

/// An SVG with axes: data coordinates in, x to the right and y up.
class Chart {
 public:
  Chart(double width, double height, const std::string& label) : width_(width), height_(height) {
    out_.precision(1);
    out_ << std::fixed << "<svg class=\"chart\" role=\"img\" aria-label=\"" << label
         << "\" viewBox=\"0 0 " << width << ' ' << height << "\">";
  }

  void set_range(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    from_ = from;
    to_ = to;
  }

  /// Same scale on both axes: the shorter one is widened around its middle.
  void keep_aspect() {
    const Eigen::Vector2d size(plot_width(), plot_height());
    const double scale = std::max((to_ - from_).x() / size.x(), (to_ - from_).y() / size.y());
    const Eigen::Vector2d middle = 0.5 * (from_ + to_);
    from_ = middle - 0.5 * scale * size;
    to_ = middle + 0.5 * scale * size;
  }

  void axes(const std::string& x_title, const std::string& y_title) {
    const double x_step = round_step((to_ - from_).x(), 7);
    const double y_step = round_step((to_ - from_).y(), 5);
    out_ << "<g class=\"grid\">";
    for (double x = std::ceil(from_.x() / x_step) * x_step; x <= to_.x(); x += x_step) {
      const double px = at({x, 0}).x();
      out_ << "<path d=\"M" << px << ' ' << kTop << "V" << height_ - kBottom << "\"/><text x=\""
           << px << "\" y=\"" << height_ - kBottom + 16 << "\" text-anchor=\"middle\">"
           << tick(x, x_step) << "</text>";
    }
    for (double y = std::ceil(from_.y() / y_step) * y_step; y <= to_.y(); y += y_step) {
      const double py = at({0, y}).y();
      out_ << "<path d=\"M" << kLeft << ' ' << py << "H" << width_ - kRight << "\"/><text x=\""
           << kLeft - 7 << "\" y=\"" << py + 4 << "\" text-anchor=\"end\">" << tick(y, y_step)
           << "</text>";
    }
    out_ << "</g><g class=\"title\"><text x=\"" << kLeft + 0.5 * plot_width() << "\" y=\""
         << height_ - 4 << "\" text-anchor=\"middle\">" << x_title << "</text><text x=\"" << 12
         << "\" y=\"" << kTop - 7 << "\">" << y_title << "</text></g>";
  }

  /// A line; steps shorter than a pixel are left out.
  void line(const Points& points, const std::string& style) {
    if (points.empty()) return;
    out_ << "<polyline fill=\"none\" stroke-linejoin=\"round\" data-style=\"" << style
         << "\" points=\"";
    Eigen::Vector2d last(-1e9, -1e9);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2d p = at(points[i]);
      if ((p - last).norm() < 1.0 && i + 1 < points.size()) continue;
      out_ << p.x() << ',' << p.y() << ' ';
      last = p;
    }
    out_ << "\"/>";
  }

  std::ostringstream& raw() { return out_; }
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d share = (p - from_).cwiseQuotient(to_ - from_);
    return {kLeft + share.x() * plot_width(), height_ - kBottom - share.y() * plot_height()};
  }
  [[nodiscard]] double bottom() const { return height_ - kBottom; }
  static double top() { return kTop; }

  std::string finish() {
    out_ << "</svg>";
    return out_.str();
  }

 private:
  static constexpr double kLeft = 52.0;
  static constexpr double kRight = 14.0;
  static constexpr double kTop = 26.0;
  static constexpr double kBottom = 40.0;
  [[nodiscard]] double plot_width() const { return width_ - kLeft - kRight; }
  [[nodiscard]] double plot_height() const { return height_ - kTop - kBottom; }

  double width_;
  double height_;
  Eigen::Vector2d from_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_ = Eigen::Vector2d::Ones();
  std::ostringstream out_;
};

std::string session_stroke(std::size_t session) {
  return "stroke:var(--s" + std::to_string(session % kSessionColors.size()) + ')';
}

Points path_of(const merge::MergedSession& session) {
  Points points;
  for (const Pose& pose : session.T_map_keyframe) points.emplace_back(pose.translation.head<2>());
  return points;
}

Points truth_of_session(const SessionSummary& session) {
  Points points;
  for (const Eigen::Vector3d& p : session.truth_in_map) points.emplace_back(p.head<2>());
  return points;
}

}  // namespace

std::string draw_trajectories(const Summary& summary, const ReportInput& input) {
  std::vector<Points> paths(summary.sessions.size());
  std::vector<Points> truths(summary.sessions.size());
  Eigen::Vector2d from(1e12, 1e12);
  Eigen::Vector2d to(-1e12, -1e12);
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    if (!merge::is_in_map(summary.sessions[s].status)) continue;
    paths[s] = path_of(input.result->sessions[s]);
    truths[s] = truth_of_session(summary.sessions[s]);
    for (const Points* points : {&paths[s], &truths[s]}) {
      for (const Eigen::Vector2d& p : *points) {
        from = from.cwiseMin(p);
        to = to.cwiseMax(p);
      }
    }
  }
  if (from.x() > to.x()) return {};
  const double margin = 0.04 * (to - from).maxCoeff() + 1.0;
  Chart chart(640, 520, "Trajectories against ground truth");
  chart.set_range(from.array() - margin, to.array() + margin);
  chart.keep_aspect();
  chart.axes("x in the map frame, m", "y, m");
  for (std::size_t s = 0; s < paths.size(); ++s) {
    chart.line(paths[s], session_stroke(s) + ";stroke-width:3.2;stroke-opacity:.75");
  }
  for (const Points& truth : truths) {
    chart.line(truth, "stroke:var(--ink);stroke-width:1.1;stroke-dasharray:5 4");
  }
  return chart.finish();
}

std::string draw_errors(const Summary& summary) {
  Eigen::Vector2d to(1.0, 0.01);
  for (const SessionSummary& session : summary.sessions) {
    for (const auto& [travelled, error] : session.error_along_path_m) {
      to = to.cwiseMax(Eigen::Vector2d(travelled, 1.08 * error));
    }
  }
  Chart chart(640, 520, "Translation error along the path");
  chart.set_range(Eigen::Vector2d::Zero(), to);
  chart.axes("distance travelled, m", "translation error, m");
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    Points points;
    for (const auto& [travelled, error] : summary.sessions[s].error_along_path_m) {
      points.emplace_back(travelled, error);
    }
    chart.line(points, session_stroke(s) + ";stroke-width:2");
  }
  return chart.finish();
}

std::string draw_latency(const SessionSummary& session, std::size_t index) {
  if (!session.stats || session.stats->histogram_counts.empty()) return {};
  const RunStats& stats = *session.stats;
  const auto& counts = stats.histogram_counts;
  const auto& edges = stats.histogram_edges_ms;
  const auto filled = [](std::uint64_t count) { return count > 0; };
  const auto first = std::find_if(counts.begin(), counts.end(), filled);
  if (first == counts.end()) return {};
  const auto last = std::find_if(counts.rbegin(), counts.rend(), filled).base();
  // One empty bin on either side shows that no bin was cut off.
  const std::size_t begin = first == counts.begin() ? 0 : first - counts.begin() - 1;
  const std::size_t end = std::min<std::size_t>(last - counts.begin() + 1, counts.size());
  const auto most = static_cast<double>(*std::max_element(counts.begin(), counts.end()));
  const auto bins = static_cast<double>(end - begin);
  Chart chart(430, 230, "Time per keyframe");
  chart.set_range({0.0, 0.0}, {bins, 1.1 * most});
  std::ostringstream& out = chart.raw();
  out << "<g class=\"grid\"><path d=\"M52 " << chart.bottom() << "H416\"/>";
  const std::size_t label_step = (end - begin + 9) / 10;
  for (std::size_t b = begin; b < end; ++b) {
    if (b >= edges.size() || (b - begin) % label_step != 0) continue;
    const double x = chart.at({static_cast<double>(b - begin + 1), 0}).x();
    out << "<text x=\"" << x << "\" y=\"" << chart.bottom() + 16 << "\" text-anchor=\"middle\">"
        << fixed(edges[b], edges[b] < 3.0 ? 1 : 0) << "</text>";
  }
  out << "</g><g data-style=\"fill:var(--s" << index % kSessionColors.size() << ")\">";
  for (std::size_t b = begin; b < end; ++b) {
    if (counts[b] == 0) continue;
    const Eigen::Vector2d top =
        chart.at({static_cast<double>(b - begin), static_cast<double>(counts[b])});
    const double right = chart.at({static_cast<double>(b - begin + 1), 0}).x();
    out << "<rect x=\"" << top.x() + 1 << "\" y=\"" << top.y() << "\" width=\""
        << right - top.x() - 2 << "\" height=\"" << chart.bottom() - top.y()
        << "\" rx=\"1.5\"/><text class=\"count\" x=\"" << 0.5 * (top.x() + right) << "\" y=\""
        << top.y() - 4 << "\" text-anchor=\"middle\">" << counts[b] << "</text>";
  }
  out << "</g><g class=\"title\"><text x=\"234\" y=\"226\" text-anchor=\"middle\">"
      << "milliseconds per keyframe, up to</text><text x=\"12\" y=\"14\">" << escaped(session.name)
      << ": keyframes</text></g>";
  return chart.finish();
}

}  // namespace unimapper::apps
