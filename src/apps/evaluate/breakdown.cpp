// `unimapper evaluate breakdown`: results of several drives as rows of Markdown tables.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "src/apps/evaluate/evaluate.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;
using evaluate::Tally;

/// Movable classes, and their names in the results of `evaluate dynamic`.
struct ClassColumn {
  const char* title;
  std::vector<std::string> classes;
};

const std::vector<ClassColumn>& class_columns() {
  static const std::vector<ClassColumn> kColumns = {
      {"pedestrian", {"pedestrian"}},
      {"cyclist", {"cyclist", "motorcyclist"}},
      {"car", {"car"}},
      {"bus, truck", {"bus", "truck", "other-vehicle"}}};
  return kColumns;
}

Json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": no such file");
  try {
    return Json::parse(in);
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

/// Counts under a key of a result; what is missing there is zero.
Tally tally_of(const Json& groups, const std::string& name) {
  Tally tally;
  const auto group = groups.find(name);
  if (group == groups.end()) return tally;
  tally.static_points = group->value("static_points", std::uint64_t{0});
  tally.static_kept = group->value("static_kept", std::uint64_t{0});
  tally.dynamic_points = group->value("dynamic_points", std::uint64_t{0});
  tally.dynamic_removed = group->value("dynamic_removed", std::uint64_t{0});
  return tally;
}

Tally sum(const std::vector<Json>& results, const char* key,
          const std::vector<std::string>& names) {
  Tally total;
  for (const Json& result : results) {
    for (const std::string& name : names) total += tally_of(result.at(key), name);
  }
  return total;
}

std::string shown(double share) {
  if (!std::isfinite(share)) return "–";
  return fmt::format("{:.2f}", 100.0 * share);
}

std::string class_row(const std::vector<Json>& results) {
  std::string row;
  for (const ClassColumn& column : class_columns()) {
    const Tally all = sum(results, "by_class", column.classes);
    const Tally moving = sum(results, "moving_by_class", column.classes);
    row += " " + shown(all.dynamic_accuracy()) + " / " + shown(moving.dynamic_accuracy()) + " |";
  }
  return row;
}

std::string range_row(const std::vector<Json>& results) {
  std::string row;
  for (std::size_t bin = 0; bin < evaluate::kRangeBinCount; ++bin) {
    const Tally all = sum(results, "by_range_m", {evaluate::range_bin_name(bin)});
    row += " " + shown(all.static_accuracy()) + " / " + shown(all.dynamic_accuracy()) + " |";
  }
  return row;
}

std::string table_header(bool by_class) {
  std::string title = by_class ? "| DA / DA moving %, by class |" : "| SA / DA %, by range |";
  std::size_t columns = 1;
  if (by_class) {
    for (const ClassColumn& column : class_columns())
      title += std::string(" ") + column.title + " |";
    columns += class_columns().size();
  } else {
    for (std::size_t bin = 0; bin < evaluate::kRangeBinCount; ++bin) {
      title += " " + evaluate::range_bin_name(bin) + " m |";
    }
    columns += evaluate::kRangeBinCount;
  }
  std::string rule = "|";
  for (std::size_t c = 0; c < columns; ++c) rule += "---|";
  return title + "\n" + rule + "\n";
}

}  // namespace

std::string evaluate_breakdown(const EvaluateBreakdownOptions& options) {
  const bool by_class = options.by == "class";
  if (!by_class && options.by != "range") {
    throw std::runtime_error("cannot break down by \"" + options.by + "\", only by class or range");
  }
  if (options.results.empty()) return table_header(by_class);
  std::vector<Json> results;
  for (const std::filesystem::path& file : options.results) {
    results.push_back(read_json(file));
    for (const char* key : {"by_class", "moving_by_class", "by_range_m"}) {
      if (results.back().contains(key)) continue;
      throw std::runtime_error(file.string() + ": is no result of `unimapper evaluate dynamic`");
    }
  }
  return "| " + options.label + " |" + (by_class ? class_row(results) : range_row(results)) + "\n";
}

}  // namespace unimapper::apps
