// Command-line tool: labels of a recording by OctoMap, cost as JSON on stdout.
#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "bench/dynamic/octomap_baseline.hpp"

namespace {

using namespace unimapper;

constexpr const char* kUsage =
    R"(usage: octomap_labels DATASET OUT [--scans N] [--voxel-m M] [--max-range-m M]

Inserts every scan into an OctoMap and writes OUT/labels: points in voxels that are free in the
finished map are dynamic.

  --scans N        only the first N scans (default: all); it takes a second or two per dense scan
  --voxel-m M      resolution (0.1)
  --max-range-m M  largest range of inserted beams (50)
)";

struct Options {
  std::vector<std::string> positional;
  bench::OctomapOptions octomap;
};

bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.empty() || word[0] != '-') {
      options.positional.push_back(word);
      continue;
    }
    const double value = i + 1 < argc ? std::atof(argv[++i]) : 0.0;
    if (!(value > 0.0)) return false;
    if (word == "--scans") {
      options.octomap.scans = static_cast<std::size_t>(value);
    } else if (word == "--voxel-m") {
      options.octomap.voxel_m = value;
    } else if (word == "--max-range-m") {
      options.octomap.max_range_m = value;
    } else {
      return false;
    }
  }
  return options.positional.size() == 2;
}

/// Peak resident memory of this process.
double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void run(const Options& options) {
  const auto dataset = datasets::open_dataset(options.positional[0]);
  const bench::OctomapCost cost =
      bench::label_with_octomap(*dataset, options.octomap, options.positional[1]);
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
  if (!parse(argc, argv, options)) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "octomap_labels: %s\n", error.what());
    return 1;
  }
}
