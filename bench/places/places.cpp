// Command-line tool: place recognition across LiDARs, compared with STD; see run.sh.
#include <cstdio>
#include <exception>
#include <iostream>

#include "bench/places/options.hpp"
#include "bench/places/pair_row.hpp"
#include "bench/places/results.hpp"
#include "bench/places/scene.hpp"
#include "bench/places/tables.hpp"
#include "ports/datasets/files.hpp"
#include "src/merge/parallel.hpp"
#include "unimapper/config/config_json.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;

constexpr const char* kReferenceRoute = "A";
// Of false loops and of missed ones, in every scene.
constexpr std::size_t kPicturesOfEach = 4;

std::vector<Variant> variants_of(const PlacesOptions& options) {
  PipelineConfig base;
  if (!options.config.empty()) {
    parse_config(datasets::read_file(options.config), options.config.string(), base);
  }
  return options.variants.empty() ? default_variant(base) : read_variants(options.variants, base);
}

/// Every LiDAR's route A with the other routes of the LiDARs that are not richer.
std::vector<DrivePair> pairs_of(const Scene& scene, const PlacesOptions& options) {
  std::vector<DrivePair> pairs;
  for (const std::string& route : options.routes) {
    for (std::size_t i = 0; i < options.sensors.size(); ++i) {
      for (std::size_t j = i; j < options.sensors.size(); ++j) {
        const SceneDrive* references = scene.find(options.sensors[i], kReferenceRoute);
        const SceneDrive* queries = scene.find(options.sensors[j], route);
        if (references == nullptr || queries == nullptr || (options.same_only && i != j)) continue;
        pairs.push_back({scene.name, references, queries, {}});
      }
    }
  }
  merge::parallel_for(pairs.size(), 0, [&](std::size_t i) { fill_view(pairs[i]); });
  return pairs;
}

bool has_baseline(const DrivePair& pair, const PlacesOptions& options) {
  if (pair.references->std_described.empty() || pair.queries->std_described.empty()) return false;
  return options.baseline == BaselineRows::kAll ||
         (options.baseline == BaselineRows::kSame &&
          pair.references->sensor == pair.queries->sensor);
}

void add_rows(const std::vector<DrivePair>& pairs, const std::vector<Variant>& variants,
              const DistractorPlaces& distractors, const PlacesOptions& options, Results& results) {
  for (std::size_t v = 0; v < variants.size(); ++v) {
    std::vector<PairRow> rows(pairs.size());
    merge::parallel_for(pairs.size(), 0, [&](std::size_t i) {
      rows[i] = database_row(pairs[i], variants[v], distractors, options.row);
    });
    if (v == 0) {
      const auto worst = worst_failures(pairs, rows, kPicturesOfEach);
      results.worst.insert(results.worst.end(), worst.begin(), worst.end());
    }
    auto& known = results.variants[v].rows;
    known.insert(known.end(), rows.begin(), rows.end());
  }
  std::vector<DrivePair> with_baseline;
  for (const DrivePair& pair : pairs) {
    if (has_baseline(pair, options)) with_baseline.push_back(pair);
  }
  std::vector<PairRow> rows(with_baseline.size());
  merge::parallel_for(with_baseline.size(), 0,
                      [&](std::size_t i) { rows[i] = std_row(with_baseline[i], options.row); });
  results.baseline.insert(results.baseline.end(), rows.begin(), rows.end());
}

/// Means and calibration only for more than one row.
void print_method(const std::string& title, const std::vector<PairRow>& rows,
                  const RowConfig& config) {
  if (rows.empty()) return;
  print_rows(std::cout, title, rows, config);
  if (rows.size() == 1) return;
  print_summary(std::cout, title, rows, config);
  print_calibration(std::cout, title, calibrate(rows));
}

void print(const PlacesOptions& options, const Results& results) {
  if (!options.ablations_only) {
    print_method(options.title, results.variants.front().rows, options.row);
    print_method(options.title + ", STD", results.baseline, options.row);
    print_std_cost(std::cout, results.baseline);
  }
  if (results.variants.size() > 1) print_ablations(std::cout, options.title, results.variants);
}

void compare(const PlacesOptions& options) {
  const std::vector<Variant> variants = variants_of(options);
  const DistractorPlaces distractors = read_distractors(options.distractors, variants);
  Results results;
  for (const Variant& variant : variants) results.variants.push_back({variant.name, {}});
  std::vector<std::string> routes = options.routes;
  routes.insert(routes.begin(), kReferenceRoute);
  for (const auto& folder : options.scenes) {
    const bool with_std = options.baseline != BaselineRows::kNone;
    const Scene scene = read_scene(folder, options.sensors, routes, variants, with_std);
    const std::vector<DrivePair> pairs = pairs_of(scene, options);
    add_rows(pairs, variants, distractors, options, results);
  }
  print(options, results);
  if (!options.out.empty() && !options.ablations_only) write_results(options.out, results);
}

}  // namespace

int main(int argc, char** argv) {
  PlacesOptions options;
  int exit_code = 0;
  if (!parse_options(argc, argv, options, exit_code)) return exit_code;
  try {
    compare(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_places: %s\n", error.what());
    return 1;
  }
}
