#include "bench/places/map_plot.hpp"

#include <map>
#include <sstream>
#include <string>
#include <utility>

#include "ports/datasets/writers.hpp"

namespace unimapper::bench {
namespace {

std::vector<const PairRow*> worst_rows(const std::vector<PairRow>& rows) {
  std::map<std::pair<PairGroup, std::string>, const PairRow*> worst;
  for (const PairRow& row : rows) {
    if (row.positives_view == 0) continue;
    const PairRow*& known = worst[{row.group, row.route}];
    if (known == nullptr || row.by_view.f1_max < known->by_view.f1_max) known = &row;
  }
  std::vector<const PairRow*> result;
  result.reserve(worst.size());
  for (const auto& [key, row] : worst) result.push_back(row);
  return result;
}

std::string track_csv(const std::vector<Eigen::Vector2d>& track) {
  std::ostringstream out;
  out << "x,y\n";
  for (const Eigen::Vector2d& p : track) out << p.x() << ',' << p.y() << '\n';
  return out.str();
}

std::string loops_csv(const PairRow& row) {
  std::ostringstream out;
  out << "x,y,match_x,match_y,right,accepted,full_precision\n";
  for (const TopCandidate& top : row.top) {
    if (!top.answered || top.match == kDistractor) continue;
    const Eigen::Vector2d& at = row.query_track[top.query];
    const Eigen::Vector2d& match = row.reference_track[top.match];
    out << at.x() << ',' << at.y() << ',' << match.x() << ',' << match.y() << ','
        << (top.right ? 1 : 0) << ',' << (top.accepted ? 1 : 0) << ','
        << (top.confidence >= row.full_precision_from ? 1 : 0) << '\n';
  }
  return out.str();
}

}  // namespace

void write_map_plots(const std::filesystem::path& folder, const std::vector<PairRow>& rows) {
  std::size_t number = 0;
  for (const PairRow* row : worst_rows(rows)) {
    const std::string name = "map-" + std::to_string(number++);
    datasets::write_text(folder / (name + ".title"),
                         row->scene + ", database " + row->reference_sensor + " route A, queries " +
                             row->query_sensor + " route " + row->route + "\n");
    datasets::write_text(folder / (name + "-database.csv"), track_csv(row->reference_track));
    datasets::write_text(folder / (name + "-queries.csv"), track_csv(row->query_track));
    datasets::write_text(folder / (name + "-loops.csv"), loops_csv(*row));
  }
}

}  // namespace unimapper::bench
