// `unimapper merge`: the command line of src/apps/merge.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "src/apps/commands.hpp"
#include "src/apps/export_options.hpp"
#include "src/apps/merge/merge_options.hpp"

namespace unimapper::apps {
namespace {

/// What the user would type again.
std::string command_line(const MergeOptions& options) {
  std::string line = "unimapper merge";
  for (const auto& run : options.runs) line += " " + run.string();
  line += " --out " + options.out.string();
  for (const auto& [session, dataset] : options.reference.truths) {
    line += " --truth " + session + "=" + dataset.string();
  }
  if (!options.config.empty()) line += " --config " + options.config.string();
  if (options.refined_labels) line += " --refined-labels";
  if (options.allow_unconnected) line += " --allow-unconnected";
  if (options.replaces) line += " --replace";
  if (!options.mcap.empty()) line += " --mcap " + options.mcap.string();
  line += export_command_line(options.output);
  for (const auto& name : options.chosen) line += " --session " + name;
  for (const auto& run : options.reference.stats) line += " --stats " + run.string();
  return line;
}

}  // namespace

void register_merge(CLI::App& app) {
  auto options = std::make_shared<MergeOptions>();
  auto dump = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand(
      "merge", "Merge any number of sessions into one static map with one frame");
  command->add_option("RUN", options->runs,
                      "Run folders written by `unimapper onboard`, LCM event logs, or stores of "
                      "`unimapper base`; the same run twice counts once");
  command
      ->add_option("--session", options->chosen,
                   "Of stores, only sessions of this name, as `unimapper inspect STORE` shows it; "
                   "may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->add_option("--out", options->out, "Folder for the map");
  command->add_flag("--replace", options->replaces,
                    "Overwrite an earlier map in that folder, and the file of --mcap");
  command->add_option("--config", options->config,
                      "JSON file with parameters that differ from the default");
  command->add_flag("--dump-config", *dump, "Print the parameters that would be used, and stop");
  add_reference_options(*command, options->reference);
  command->add_flag("--refined-labels", options->refined_labels,
                    "Write OUT/refined/SESSION/labels for sessions with --truth: what is static "
                    "after all, point by point");
  command->add_flag("--allow-unconnected", options->allow_unconnected,
                    "End with exit code 0 although a session is left apart from the map");
  command->add_option("--mcap", options->mcap,
                      "Write the map, what was removed, trajectories and loops as MCAP with "
                      "Foxglove's schemas, too");
  add_export_options(*command, options->output);
  command
      ->add_option("--threads", options->threads,
                   "Threads to use; 0: all. The map does not depend on it")
      ->check(CLI::Range(0, 256));
  command
      ->add_option("--memory", options->memory_mb,
                   "Megabytes for keyframes and clouds; the map does not depend on it")
      ->check(CLI::Range(1, 1'000'000));
  command->footer(
      "Examples:\n"
      "  unimapper merge runs/monday runs/friday --out map\n"
      "  unimapper merge site --out map");
  command->callback([options, dump] {
    if (*dump) {
      std::cout << effective_config(*options);
      return;
    }
    if (options->out.empty()) throw CLI::RequiredError("--out");
    if (options->runs.empty()) throw CLI::ValidationError("merge", "give at least one RUN");
    options->command_line = command_line(*options);
    run_merge(*options);
  });
}

}  // namespace unimapper::apps
