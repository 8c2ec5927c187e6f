// Command-line tool: labels of a recording by OctoMap, cost as JSON on stdout.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "bench/dynamic/octomap_baseline.hpp"

namespace {

using namespace unimapper;

struct Options {
  std::filesystem::path dataset;
  std::filesystem::path out;
  bench::OctomapOptions octomap;
};

/// Peak resident memory of this process.
double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void run(const Options& options) {
  const auto dataset = datasets::open_dataset(options.dataset);
  const bench::OctomapCost cost = bench::label_with_octomap(*dataset, options.octomap, options.out);
  const double scans = static_cast<double>(cost.scans > 0 ? cost.scans : 1);
  std::printf(
      "{\n  \"scans\": %zu,\n  \"ms_per_scan\": %.1f,\n  \"longest_ms\": %.1f,\n"
      "  \"tree_mb\": %.1f,\n  \"peak_mb\": %.1f\n}\n",
      cost.scans, cost.cpu_ms / scans, cost.longest_ms,
      static_cast<double>(cost.tree_bytes) / 1048576.0, peak_mb());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{
      "Inserts every scan into an OctoMap and writes OUT/labels: dynamic is what is free in the "
      "end. Prints JSON."};
  app.add_option("DATASET", options.dataset, "Recording to label")->required();
  app.add_option("OUT", options.out, "Run folder to write")->required();
  app.add_option("--scans", options.octomap.scans,
                 "Only the first scans (default: all); it takes a second or two per dense scan")
      ->check(CLI::PositiveNumber);
  app.add_option("--voxel-m", options.octomap.voxel_m, "Resolution")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--max-range-m", options.octomap.max_range_m, "Beams are inserted up to here")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "octomap_labels: %s\n", error.what());
    return 1;
  }
}
