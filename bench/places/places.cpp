// Command-line tool: place recognition across LiDARs, compared with STD; see run.sh.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>

#include "bench/places/pair_row.hpp"
#include "src/merge/parallel.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;
namespace fs = std::filesystem;

struct Options {
  std::vector<fs::path> scenes;
  std::string title;
  std::vector<std::string> sensors;
  std::vector<std::string> routes = {"B", "C"};
  double near_m = 10.0;
  fs::path recording;  ///< describe the run by STD instead
};

/// Drives SCENE/SENSOR-ROUTE; missing ones are left out.
std::vector<Drive> read_drives(const fs::path& scene, const Options& options) {
  std::vector<fs::path> runs;
  for (const std::string& sensor : options.sensors) {
    std::vector<std::string> routes = options.routes;
    routes.emplace_back("A");
    for (const std::string& route : routes) {
      const fs::path run = scene / std::string(sensor).append("-").append(route);
      if (fs::exists(run / "keyframes.lcmlog")) runs.push_back(run);
    }
  }
  std::vector<Drive> drives(runs.size());
  merge::parallel_for(runs.size(), 0, [&](std::size_t i) { drives[i] = read_drive(runs[i]); });
  return drives;
}

/// Every LiDAR's route A with the other routes of it and of the LiDARs that are not richer.
std::vector<std::pair<const Drive*, const Drive*>> pairs_of(const std::vector<Drive>& drives,
                                                            const Options& options) {
  std::vector<std::pair<const Drive*, const Drive*>> pairs;
  for (const std::string& route : options.routes) {
    for (std::size_t i = 0; i < drives.size(); ++i) {
      for (std::size_t j = 0; j < drives.size(); ++j) {
        const bool is_poorer = j > i || drives[i].sensor == drives[j].sensor;
        if (drives[i].route != "A" || drives[j].route != route || !is_poorer) continue;
        pairs.emplace_back(&drives[i], &drives[j]);
      }
    }
  }
  return pairs;
}

void compare(const Options& options) {
  std::vector<PairRow> ours;
  std::vector<PairRow> baseline;
  for (const fs::path& scene : options.scenes) {
    const std::vector<Drive> drives = read_drives(scene, options);
    const auto pairs = pairs_of(drives, options);
    const std::size_t first = ours.size();
    ours.resize(first + pairs.size());
    std::vector<PairRow> std_rows(pairs.size());
    merge::parallel_for(pairs.size(), 0, [&](std::size_t i) {
      const auto& [references, queries] = pairs[i];
      const auto score = [&](const Retrieval& retrieval) {
        return score_pair(*references, *queries, retrieval, options.near_m);
      };
      ours[first + i] = score(search_database(*references, *queries));
      std_rows[i] = score(search_std(*references, *queries));
    });
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto& [references, queries] = pairs[i];
      if (references->std_places.empty() || queries->std_places.empty()) continue;
      baseline.push_back(std_rows[i]);
    }
  }
  print_rows(std::cout, options.title, ours);
  if (!baseline.empty()) print_rows(std::cout, options.title + ", STD", baseline);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{
      "Place recognition across LiDARs: places of other routes are searched for in drives of "
      "route A, by our database and by STD. Prints Markdown tables."};
  app.add_option("SCENE", options.scenes,
                 "Folders of drives, SCENE/<sensor>-<route>, each with keyframes.lcmlog, "
                 "gt_poses.txt and, for STD, std.places")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--title", options.title, "Title of the tables");
  app.add_option("--sensors", options.sensors, "LiDARs, from the richest to the poorest")
      ->delimiter(',');
  app.add_option("--routes", options.routes, "Routes of the queries")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--distance", options.near_m, "Positives by distance, metres")
      ->capture_default_str();
  app.add_option("--describe-std", options.recording,
                 "Instead: write std.places of the run SCENE, from the scans of this recording");
  CLI11_PARSE(app, argc, argv);
  try {
    if (options.recording.empty()) {
      compare(options);
    } else {
      describe_std(options.scenes.front(), options.recording);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_places: %s\n", error.what());
    return 1;
  }
}
