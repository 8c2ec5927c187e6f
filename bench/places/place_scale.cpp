// Command-line tool: search time and recall among 60 to 100,000 places; see run.sh.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <sstream>
#include <string>

#include "bench/places/database_scaling.hpp"
#include "ports/datasets/writers.hpp"
#include "src/merge/loop_search.hpp"
#include "src/merge/parallel.hpp"
#include "src/place/triangle_table.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;
namespace fs = std::filesystem;

constexpr std::uint32_t kOnboardSizes[] = {60, 250, 500, 1000, 2000};
constexpr std::uint32_t kBaseSizes[] = {60,   250,   500,   1000,  2000,
                                        5000, 10000, 20000, 50000, 100000};

struct ScaleOptions {
  fs::path known;
  std::vector<fs::path> queries;
  std::vector<fs::path> distractors;
  fs::path out;
  std::uint32_t largest = 100000;
  std::uint32_t seed = 1;
};

std::vector<std::uint32_t> up_to(std::span<const std::uint32_t> sizes, std::size_t largest) {
  std::vector<std::uint32_t> result;
  for (const std::uint32_t size : sizes) {
    if (size <= largest) result.push_back(size);
  }
  return result;
}

std::vector<DescribedDrive> read_distractors(const std::vector<fs::path>& runs) {
  std::vector<DescribedDrive> drives(runs.size());
  merge::parallel_for(runs.size(), 0, [&](std::size_t i) {
    drives[i] = read_and_describe(runs[i], false);
    drives[i].drive = {};  // only the places are needed
  });
  return drives;
}

/// A dash if there were no positives.
std::string percent(double share) {
  if (std::isnan(share)) return "–";
  char text[16];
  std::snprintf(text, sizeof text, "%.1f", 100.0 * share);
  return text;
}

void print_scaling(const char* title, const ScalingResult& scaling) {
  std::printf(
      "\n| %s, places | insert ms | query p50 ms | p99 ms | found %% | accepted %% | accepted "
      "wrong | dropped |\n|---|---|---|---|---|---|---|---|\n",
      title);
  for (const ScalingStep& step : scaling.steps) {
    std::printf("| %u | %.3f | %.2f | %.2f | %s | %s | %zu | %llu |\n", step.places, step.insert_ms,
                step.query_p50_ms, step.query_p99_ms, percent(step.found_share).c_str(),
                percent(step.accepted_share).c_str(), step.wrong,
                static_cast<unsigned long long>(step.dropped));
  }
  std::printf("\n%s: %.1f MB in all, %zu bytes for a stored triangle.\n", title,
              static_cast<double>(scaling.bytes) / 1e6, place::TriangleTable::entry_bytes());
  std::fflush(stdout);  // the next measurement takes minutes
}

void write_scaling(const fs::path& file, const ScalingResult& scaling) {
  std::ostringstream out;
  out << "places,insert_ms,query_p50_ms,query_p99_ms,found,accepted,wrong\n";
  for (const ScalingStep& step : scaling.steps) {
    out << step.places << ',' << step.insert_ms << ',' << step.query_p50_ms << ','
        << step.query_p99_ms << ',' << step.found_share << ',' << step.accepted_share << ','
        << step.wrong << '\n';
  }
  datasets::write_text(file, out.str());
}

void measure(const ScaleOptions& options) {
  const ScalingTask task = make_task(options.known, options.queries);
  const std::vector<DescribedDrive> drives = read_distractors(options.distractors);
  std::size_t available = task.known.places.size();
  for (const DescribedDrive& drive : drives) available += drive.places.size();

  const LoopSearchConfig onboard_config;
  const ScalingResult onboard = measure_scaling(
      task, real_places(drives),
      up_to(kOnboardSizes, std::min<std::size_t>(available, options.largest)), onboard_config);
  print_scaling("onboard", onboard);
  // A merger lays its database out for as many places as there are.
  ScalingResult base;
  for (const std::uint32_t size : up_to(kBaseSizes, options.largest)) {
    const ScalingResult one = measure_scaling(task, synthetic_places(drives, options.seed), {size},
                                              merge::base_search_config(size));
    base.steps.insert(base.steps.end(), one.steps.begin(), one.steps.end());
    base.bytes = one.bytes;
  }
  print_scaling("base", base);
  if (options.out.empty()) return;
  datasets::make_directory(options.out);
  write_scaling(options.out / "scale-onboard.csv", onboard);
  write_scaling(options.out / "scale-base.csv", base);
}

}  // namespace

int main(int argc, char** argv) {
  ScaleOptions options;
  CLI::App app{
      "Query time over the size of the database: onboard among the places of real drives, at the "
      "base among synthetic places composed of them."};
  app.add_option("--known", options.known, "Run folder of the reference places")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--queries", options.queries, "Run folders through the same scene")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--distractors", options.distractors, "Run folders through other scenes")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--largest", options.largest, "Largest database")
      ->capture_default_str()
      ->check(CLI::Range(60U, 1048576U));
  app.add_option("--seed", options.seed, "Seed of the synthetic places")->capture_default_str();
  app.add_option("--out", options.out, "Folder for CSV files");
  CLI11_PARSE(app, argc, argv);
  try {
    measure(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_place_scale: %s\n", error.what());
    return 1;
  }
}
