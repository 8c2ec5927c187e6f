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
  bool replaces = false;
};

}  // namespace

void register_export(CLI::App& app) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* command = app.add_subcommand(
      "export", "Write a run's static cloud, removed points, poses and loops for other programs");
  command->add_option("RUN", options->run, "Run folder written by `unimapper onboard`")->required();
  command
      ->add_option("--mcap", options->mcap,
                   "File to write: MCAP with Foxglove's schemas, shown by Foxglove")
      ->required();
  command->add_flag("--replace", options->replaces, "Overwrite that file");
  command->footer("Example:\n  unimapper export runs/monday --mcap monday.mcap");
  command->callback([options] {
    check_output_file(options->mcap, options->replaces);
    FileReplacement file(options->mcap);
    write_scene(file.path(), scene_of_run(options->run));
    file.publish();
    std::cerr << "unimapper: " << options->mcap.string() << " written\n";
  });
}

}  // namespace unimapper::apps
