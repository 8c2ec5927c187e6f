// Command-line options of what is written of a map.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>

#include "unimapper/merge/export.hpp"

namespace unimapper::apps {

/// Adds --box, --voxel, --tile, --las, --grid and --grid-height to a command.
void add_export_options(CLI::App& command, merge::ExportOptions& options);

/// The export options as the user would type them, each with a space before it.
[[nodiscard]] std::string export_command_line(const merge::ExportOptions& options);

/// Says on stderr what a grid leaves out.
void report_grid(const std::optional<merge::NavigationGrid>& grid);

}  // namespace unimapper::apps
