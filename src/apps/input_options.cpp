#include "src/apps/input_options.hpp"

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "ports/datasets/readers.hpp"

namespace unimapper::apps {
namespace {

std::string describe_formats() {
  std::string text = "How the recording is laid out; auto: as it looks.";
  for (const datasets::Reader& reader : datasets::readers()) {
    text += "\n" + std::string(reader.name) + ": " + std::string(reader.description);
  }
  return text;
}

std::vector<std::string> formats() {
  std::vector<std::string> names = {"auto"};
  for (const datasets::Reader& reader : datasets::readers()) names.emplace_back(reader.name);
  return names;
}

}  // namespace

void add_open_options(CLI::App& command, datasets::OpenOptions& options) {
  command.add_option("--format", options.format, describe_formats())
      ->capture_default_str()
      ->check(CLI::IsMember(formats()).description(""))
      ->group("Input");
  command
      .add_option("--sensor", options.sensor,
                  "LiDAR, e.g. os2-128, livox-avia, vlp-16; default: as the recording says")
      ->group("Input");
}

}  // namespace unimapper::apps
