#include "bench/places/tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "bench/places/quantile.hpp"

namespace unimapper::bench {
namespace {

std::string number(double value, int digits) {
  if (std::isnan(value)) return "–";
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

/// Of some rows, for one notion of a true match.
struct FiguresMean {
  double f1 = 0.0;
  double auc = 0.0;
  double recall = 0.0;
};

using Rows = std::vector<const PairRow*>;

double mean_of(const Rows& rows, const std::function<double(const PairRow&)>& figure) {
  std::vector<double> values;
  for (const PairRow* row : rows) values.push_back(figure(*row));
  return mean(values);
}

std::size_t sum_of(const Rows& rows, const std::function<std::size_t(const PairRow&)>& count) {
  std::size_t sum = 0;
  for (const PairRow* row : rows) sum += count(*row);
  return sum;
}

/// Rows without positives are left out.
FiguresMean figures_mean(const Rows& rows, evaluate::LoopFigures PairRow::*figures,
                         std::size_t PairRow::*positives) {
  Rows with_positives;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(with_positives),
               [&](const PairRow* row) { return row->*positives > 0; });
  return {mean_of(with_positives, [&](const PairRow& row) { return (row.*figures).f1_max; }),
          mean_of(with_positives, [&](const PairRow& row) { return (row.*figures).auc; }),
          mean_of(with_positives,
                  [&](const PairRow& row) { return (row.*figures).recall_at_full_precision; })};
}

std::string triple(const FiguresMean& mean) {
  return number(mean.f1, 3) + " / " + number(mean.auc, 3) + " / " + number(mean.recall, 3);
}

std::string figure_titles(const RowConfig& config) {
  const std::string near = number(config.near_m, 0) + " m";
  const std::string paper = number(config.paper_m, 0) + " m";
  return " positives " + near + " / " + paper + " / view | by distance " + near +
         ": F1 / AUC / R at P=1 | by distance " + paper +
         " | by pose | by view | loops at P=1 | accepted right / wrong | error m / deg | "
         "repeatability 0.5 m / 0.3 m | ms describe / search |";
}

/// The columns that rows and summaries share; of one row, its own figures.
std::string figure_columns(const Rows& rows) {
  const auto count = [&](std::size_t PairRow::*what) {
    return std::to_string(sum_of(rows, [&](const PairRow& row) { return row.*what; }));
  };
  const auto average = [&](double PairRow::*what, int digits) {
    return number(mean_of(rows, [&](const PairRow& row) { return row.*what; }), digits);
  };
  std::string text = " " + count(&PairRow::positives_near) + " / " +
                     count(&PairRow::positives_paper) + " / " + count(&PairRow::positives_view);
  text += " | " + triple(figures_mean(rows, &PairRow::by_distance, &PairRow::positives_near));
  text +=
      " | " + triple(figures_mean(rows, &PairRow::by_paper_distance, &PairRow::positives_paper));
  text += " | " + triple(figures_mean(rows, &PairRow::by_pose, &PairRow::positives_near));
  text += " | " + triple(figures_mean(rows, &PairRow::by_view, &PairRow::positives_view));
  text += " | " + count(&PairRow::loops_at_full_precision);
  text += " | " + std::to_string(sum_of(rows, [](const PairRow& row) {
            return row.by_pose.operating_point.true_positives;
          }));
  text += " / " + std::to_string(sum_of(rows, [](const PairRow& row) {
            return row.by_pose.operating_point.false_positives;
          }));
  text += " | " + average(&PairRow::error_m, 3) + " / " + average(&PairRow::error_deg, 2);
  text += " | " + average(&PairRow::repeatability, 2) + " / " +
          average(&PairRow::repeatability_narrow, 2);
  text += " | " + average(&PairRow::describe_ms, 2) + " / " + average(&PairRow::search_ms, 2);
  return text + " |\n";
}

std::string rule(std::size_t leading_columns) {
  std::string text = "|";
  for (std::size_t i = 0; i < leading_columns + 10; ++i) text += "---|";
  return text + "\n";
}

std::vector<std::string> routes_of(const std::vector<PairRow>& rows) {
  std::vector<std::string> routes;
  for (const PairRow& row : rows) {
    if (std::find(routes.begin(), routes.end(), row.route) == routes.end()) {
      routes.push_back(row.route);
    }
  }
  return routes;
}

Rows select(const std::vector<PairRow>& rows, const std::function<bool(const PairRow&)>& choose) {
  Rows selected;
  for (const PairRow& row : rows) {
    if (choose(row)) selected.push_back(&row);
  }
  return selected;
}

}  // namespace

void print_rows(std::ostream& out, const std::string& title, const std::vector<PairRow>& rows,
                const RowConfig& config) {
  out << "\n| " << title << ": database | queries | route |" << figure_titles(config) << "\n"
      << rule(3);
  for (const PairRow& row : rows) {
    out << "| " << row.reference_sensor << " | " << row.query_sensor << " | " << row.route << " |"
        << figure_columns({&row});
  }
}

void print_summary(std::ostream& out, const std::string& title, const std::vector<PairRow>& rows,
                   const RowConfig& config) {
  out << "\n| " << title << ", mean (counts: sum) | route | rows |" << figure_titles(config) << "\n"
      << rule(3);
  for (const std::string& route : routes_of(rows)) {
    for (const PairGroup group : kPairGroups) {
      const Rows chosen = select(
          rows, [&](const PairRow& row) { return row.route == route && row.group == group; });
      if (chosen.empty()) continue;
      out << "| " << name_of(group) << " | " << route << " | " << chosen.size() << " |"
          << figure_columns(chosen);
    }
  }
}

void print_ablations(std::ostream& out, const std::string& title,
                     const std::vector<VariantRows>& variants) {
  out << "\n| " << title << ", F1 by pose / by view / R at P=1 by view |";
  for (const PairGroup group : kPairGroups) out << " " << name_of(group) << " |";
  out << " repeatability 0.5 m | search ms |\n|---|---|---|---|---|---|---|\n";
  for (const VariantRows& variant : variants) {
    out << "| " << variant.name << " |";
    for (const PairGroup group : kPairGroups) {
      const Rows chosen =
          select(variant.rows, [&](const PairRow& row) { return row.group == group; });
      const auto pose = figures_mean(chosen, &PairRow::by_pose, &PairRow::positives_near);
      const auto view = figures_mean(chosen, &PairRow::by_view, &PairRow::positives_view);
      out << " " << number(pose.f1, 3) << " / " << number(view.f1, 3) << " / "
          << number(view.recall, 3) << " |";
    }
    const Rows all = select(variant.rows, [](const PairRow&) { return true; });
    out << " " << number(mean_of(all, [](const PairRow& row) { return row.repeatability; }), 3)
        << " | " << number(mean_of(all, [](const PairRow& row) { return row.search_ms; }), 2)
        << " |\n";
  }
}

void print_std_cost(std::ostream& out, const std::vector<PairRow>& rows) {
  if (rows.empty()) return;
  std::vector<double> triangles;
  std::vector<double> search_ms;
  for (const PairRow& row : rows) {
    triangles.push_back(static_cast<double>(row.triangles));
    search_ms.push_back(row.search_ms);
  }
  out << "\nSTD's database holds " << number(mean(triangles), 0)
      << " triangles, mean of these rows; a search takes " << number(mean(search_ms), 1)
      << " ms.\n";
}

void print_calibration(std::ostream& out, const std::string& title,
                       const std::vector<CalibrationBin>& bins) {
  out << "\n| " << title << ", confidence from | to | top candidates | right % | "
      << "of these and all above: right % |\n|---|---|---|---|---|\n";
  for (const CalibrationBin& bin : bins) {
    out << "| " << number(bin.from, 1) << " | " << number(bin.to, 1) << " | " << bin.answers
        << " | " << number(100.0 * bin.right_share(), 1) << " | "
        << number(100.0 * bin.right_share_above(), 1) << " |\n";
  }
}

}  // namespace unimapper::bench
