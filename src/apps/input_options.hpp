// Command-line options of how a recording is read.
#pragma once

#include <filesystem>

namespace CLI {
class App;
}
namespace unimapper::datasets {
struct OpenOptions;
}

namespace unimapper::apps {

/// Adds the options of `OpenOptions` to `command`, in a group of their own in its help. `options`
/// must outlive the parsing.
void add_open_options(CLI::App& command, datasets::OpenOptions& options);

/// Adds --sensor-file to the same group.
void add_sensor_file_option(CLI::App& command, std::filesystem::path& file);

}  // namespace unimapper::apps
