// Command-line options of what is written of a map.
#include "src/apps/export_options.hpp"

#include <fmt/format.h>

#include <iostream>
#include <string>
#include <vector>

#include "src/apps/map/projection.hpp"

namespace unimapper::apps {
namespace {

merge::MapBox box_of(const std::vector<double>& faces) {
  merge::MapBox box;
  box.low = {faces[0], faces[1], faces[2]};
  box.high = {faces[3], faces[4], faces[5]};
  if ((box.low.array() > box.high.array()).any()) {
    throw CLI::ValidationError("--box", "a lower corner, then an upper one: x y z x y z");
  }
  return box;
}

std::string number(double value) { return fmt::format(" {:.10g}", value); }

}  // namespace

void add_export_options(CLI::App& command, merge::ExportOptions& options) {
  command
      .add_option_function<std::vector<double>>(
          "--box", [&options](const std::vector<double>& faces) { options.box = box_of(faces); },
          "Write only points in this part of the map frame: x y z x y z, metres")
      ->expected(6);
  command
      .add_option("--voxel", options.voxel_m,
                  "Write one point of the map per voxel of this edge, metres")
      ->check(CLI::Range(0.01, 1000.0));
  command
      .add_option("--tile", options.tile_m,
                  "Write the map as tiles of this edge, metres, too: tiles/X_Y.ply")
      ->check(CLI::Range(1.0, 1e6));
  command.add_flag("--las", options.las,
                   "Write the map, and its tiles, as LAS 1.4, too: map.las, tiles/X_Y.las");
  command.add_option("--crs", options.crs.name,
                     "Coordinate system of known positions, written into LAS files, "
                     "summary.json and georeference.json. " +
                         std::string(kSystemHelp));
  CLI::Option* grid = command
                          .add_option_function<double>(
                              "--grid",
                              [&options](double resolution_m) {
                                if (!options.grid) options.grid.emplace();
                                options.grid->resolution_m = resolution_m;
                              },
                              "Write a navigation grid with cells of this edge, metres: grid.pgm "
                              "and grid.yaml")
                          ->check(CLI::Range(0.02, 10.0));
  command
      .add_option_function<double>(
          "--grid-height",
          [&options](double clearance_m) {
            if (!options.grid) options.grid.emplace();
            options.grid->clearance_m = clearance_m;
          },
          "Height of the robot for the grid, metres (2): what is above is no obstacle")
      ->check(CLI::Range(0.3, 10.0))
      ->needs(grid);
}

std::string export_command_line(const merge::ExportOptions& options) {
  std::string line;
  if (options.box) {
    line += " --box";
    for (const Eigen::Vector3d& corner : {options.box->low, options.box->high}) {
      for (const double value : corner) line += number(value);
    }
  }
  if (options.voxel_m > 0.0) line += " --voxel" + number(options.voxel_m);
  if (options.tile_m > 0.0) line += " --tile" + number(options.tile_m);
  if (options.las) line += " --las";
  if (!options.crs.name.empty()) line += " --crs '" + options.crs.name + "'";
  if (options.grid) {
    line += " --grid" + number(options.grid->resolution_m) + " --grid-height" +
            number(options.grid->clearance_m);
  }
  return line;
}

void find_system(merge::ExportOptions& options) {
  if (!options.crs.name.empty()) options.crs = Projection(options.crs.name).system();
}

void warn_of_place(const merge::ExportOptions& options, const merge::MergeResult& result) {
  if (options.crs.name.empty() || !result.georeference) return;
  const std::string doubt = Projection(options.crs.name).doubt(result.georeference->origin);
  if (!doubt.empty()) std::cerr << "unimapper: warning: " << doubt << '\n';
}

void report_grid(const std::optional<merge::NavigationGrid>& grid) {
  if (!grid) return;
  if (grid->cells.empty()) {
    std::cerr << "unimapper: warning: the grid is empty: no ground in the map\n";
  }
  if (grid->several_levels == 0) return;
  std::cerr << "unimapper: warning: " << grid->several_levels
            << " cells of the grid lie on several storeys; it has that which was driven first\n";
}

}  // namespace unimapper::apps
