// `unimapper export`: results of a run for other programs.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>

#include "src/apps/commands.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/replacement.hpp"
#include "src/apps/scene/result_scene.hpp"

namespace unimapper::apps {
namespace {

struct ExportOptions {
  std::filesystem::path run;
  std::filesystem::path mcap;
  std::filesystem::path las;
  bool replaces = false;
};

/// What `write` writes is there when it is whole.
template <typename Write>
void write_file(const std::filesystem::path& path, const Write& write) {
  FileReplacement file(path);
  write(file.path());
  file.publish();
  std::cerr << "unimapper: " << path.string() << " written\n";
}

}  // namespace

void register_export(CLI::App& app) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* command = app.add_subcommand(
      "export", "Write a run's static cloud, removed points, poses and loops for other programs");
  command->add_option("RUN", options->run, "Run folder written by `unimapper onboard`")->required();
  CLI::Option_group* files = command->add_option_group("Files", "One of these, or both");
  files->add_option("--mcap", options->mcap,
                    "File to write: MCAP with Foxglove's schemas, shown by Foxglove");
  files->add_option("--las", options->las, "File to write: the static cloud as LAS 1.4");
  files->require_option(1, 2);
  command->add_flag("--replace", options->replaces, "Overwrite the files");
  command->footer("Example:\n  unimapper export runs/monday --mcap monday.mcap --las monday.las");
  command->callback([options] {
    if (options->mcap == options->las) {
      throw std::runtime_error(options->mcap.string() + ": is given for two files");
    }
    for (const auto& file : {options->mcap, options->las}) {
      if (!file.empty()) check_output_file(file, options->replaces);
    }
    if (!options->mcap.empty()) {
      write_file(options->mcap, [&](const std::filesystem::path& file) {
        write_scene(file, scene_of_run(options->run));
      });
    }
    if (!options->las.empty()) {
      write_file(options->las,
                 [&](const std::filesystem::path& file) { write_las_of_run(file, options->run); });
    }
  });
}

}  // namespace unimapper::apps
