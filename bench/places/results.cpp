#include "bench/places/results.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "bench/places/calibration.hpp"
#include "bench/places/failures.hpp"
#include "bench/places/map_plot.hpp"
#include "ports/datasets/writers.hpp"

namespace unimapper::bench {
namespace {

void put_figures(std::ostream& out, const evaluate::LoopFigures& figures) {
  out << ',' << figures.f1_max << ',' << figures.auc << ',' << figures.recall_at_full_precision;
}

void put_rows(std::ostream& out, const std::string& method, const std::vector<PairRow>& rows) {
  for (const PairRow& row : rows) {
    out << '"' << method << "\"," << row.scene << ',' << row.reference_sensor << ','
        << row.query_sensor << ',' << row.route << ',' << name_of(row.group) << ','
        << row.positives_near << ',' << row.positives_paper << ',' << row.positives_view;
    put_figures(out, row.by_distance);
    put_figures(out, row.by_paper_distance);
    put_figures(out, row.by_pose);
    put_figures(out, row.by_view);
    const evaluate::PrecisionRecall& accepted = row.by_pose.operating_point;
    out << ',' << row.loops_at_full_precision << ',' << accepted.true_positives << ','
        << accepted.false_positives << ',' << row.error_m << ',' << row.error_deg << ','
        << row.repeatability << ',' << row.repeatability_narrow << ',' << row.describe_ms << ','
        << row.search_ms << ',' << row.triangles << '\n';
  }
}

std::string rows_csv(const Results& results) {
  std::ostringstream out;
  out << "method,scene,database,queries,route,group,positives_near,positives_paper,positives_view";
  for (const char* by : {"distance_near", "distance_paper", "pose", "view"}) {
    out << ",f1_" << by << ",auc_" << by << ",r_at_p100_" << by;
  }
  out << ",loops_at_p100,accepted_right,accepted_wrong,error_m,error_deg,repeatability_05m,"
         "repeatability_03m,describe_ms,search_ms,std_triangles\n";
  for (const VariantRows& variant : results.variants) put_rows(out, variant.name, variant.rows);
  put_rows(out, "STD", results.baseline);
  return out.str();
}

constexpr const char* kAnswerColumns =
    "method,scene,database,queries,route,query,match,confidence,accepted,right,error_m,error_deg,"
    "nearest_m,best_view";

void put_answer(std::ostream& out, const char* method, const PairRow& row,
                const TopCandidate& top) {
  out << method << ',' << row.scene << ',' << row.reference_sensor << ',' << row.query_sensor << ','
      << row.route << ',' << top.query << ',';
  if (top.answered) {
    out << (top.match == kDistractor ? "elsewhere" : std::to_string(top.match)) << ','
        << top.confidence << ',' << (top.accepted ? 1 : 0) << ',' << (top.right ? 1 : 0) << ','
        << top.error_m << ',' << top.error_deg;
  } else {
    out << ",,,,,";
  }
  out << ',' << top.nearest_m << ',' << top.best_view;
}

std::string answers_csv(const Results& results) {
  std::ostringstream out;
  out << kAnswerColumns << '\n';
  const auto put_all = [&](const char* method, const std::vector<PairRow>& rows) {
    for (const PairRow& row : rows) {
      for (const TopCandidate& top : row.top) {
        put_answer(out, method, row, top);
        out << '\n';
      }
    }
  };
  put_all("ours", results.variants.front().rows);
  put_all("STD", results.baseline);
  return out.str();
}

std::string worst_csv(const std::vector<PairRow>& rows) {
  std::ostringstream out;
  out << kAnswerColumns << ",why\n";
  for (const Failure& failure : failures_of(rows)) {
    put_answer(out, "ours", rows[failure.row], *failure.top);
    out << ",\"" << failure.why << "\"\n";
  }
  return out.str();
}

std::string calibration_csv(const Results& results) {
  std::ostringstream out;
  out << "method,from,to,answers,right,answers_above,right_above\n";
  const auto put_bins = [&](const char* method, const std::vector<PairRow>& rows) {
    for (const CalibrationBin& bin : calibrate(rows)) {
      out << method << ',' << bin.from << ',' << bin.to << ',' << bin.answers << ',' << bin.right
          << ',' << bin.answers_above << ',' << bin.right_above << '\n';
    }
  };
  put_bins("ours", results.variants.front().rows);
  put_bins("STD", results.baseline);
  return out.str();
}

void write_curve(const std::filesystem::path& file, const std::vector<PairRow>& rows,
                 PairGroup group) {
  std::vector<const PairRow*> chosen;
  for (const PairRow& row : rows) {
    if (row.group == group) chosen.push_back(&row);
  }
  std::ostringstream out;
  out << "criterion,confidence,recall,precision\n";
  const auto put_curve = [&](const char* criterion, bool TopCandidate::*positive) {
    for (const evaluate::CurvePoint& point : pooled_curve(chosen, positive)) {
      out << criterion << ',' << point.confidence << ',' << point.recall << ',' << point.precision
          << '\n';
    }
  };
  put_curve("pose", &TopCandidate::near);
  put_curve("view", &TopCandidate::view);
  datasets::write_text(file, out.str());
}

}  // namespace

void write_results(const std::filesystem::path& folder, const Results& results) {
  datasets::make_directory(folder);
  const std::vector<PairRow>& rows = results.variants.front().rows;
  datasets::write_text(folder / "rows.csv", rows_csv(results));
  datasets::write_text(folder / "answers.csv", answers_csv(results));
  datasets::write_text(folder / "worst.csv", worst_csv(rows));
  datasets::write_text(folder / "calibration.csv", calibration_csv(results));
  for (const PairGroup group : kPairGroups) {
    std::string name = name_of(group);
    std::replace(name.begin(), name.end(), ' ', '-');
    write_curve(folder / ("curve-" + name + "-ours.csv"), rows, group);
    write_curve(folder / ("curve-" + name + "-STD.csv"), results.baseline, group);
  }
  write_map_plots(folder, rows);
  write_failure_pictures(folder, results.worst);
}

}  // namespace unimapper::bench
