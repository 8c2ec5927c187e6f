// Command-line options of what is written of a map.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>

#include "unimapper/merge/export.hpp"

namespace unimapper::apps {

/// How a coordinate system is named.
inline constexpr const char* kSystemHelp =
    "East and north in metres, by PROJ: EPSG:25832, EPSG:32632+5773 (with heights), a name or WKT";

/// Adds --box, --voxel, --tile, --las, --crs, --grid and --grid-height to a command.
void add_export_options(CLI::App& command, merge::ExportOptions& options);

/// Looks up the coordinate system that `options` name. Throws std::runtime_error with the remedy.
void find_system(merge::ExportOptions& options);

/// Says on stderr if a map is not where its coordinate system is used.
void warn_of_place(const merge::ExportOptions& options, const merge::MergeResult& result);

/// The export options as the user would type them, each with a space before it.
[[nodiscard]] std::string export_command_line(const merge::ExportOptions& options);

/// Says on stderr what a grid leaves out.
void report_grid(const std::optional<merge::NavigationGrid>& grid);

}  // namespace unimapper::apps
