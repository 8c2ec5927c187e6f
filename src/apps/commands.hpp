// Subcommands of the command-line tool.
#pragma once

#include <vector>

namespace CLI {
class App;
}

namespace unimapper::apps {

/// Each adds one subcommand with its options to `app`; the work starts in the subcommand's
/// callback. Callbacks throw std::exception with a sentence for the user on bad input.
void register_base(CLI::App& app);
void register_simulate(CLI::App& app);
void register_onboard(CLI::App& app);
void register_odometry(CLI::App& app);
void register_project(CLI::App& app);
void register_merge(CLI::App& app);
void register_evaluate(CLI::App& app);
void register_export(CLI::App& app);
void register_fleet(CLI::App& app);
void register_inspect(CLI::App& app);
void register_keys(CLI::App& app);
void register_localise(CLI::App& app);
void register_parameters(CLI::App& app);
void register_reference(CLI::App& app);
void register_view(CLI::App& app);
void register_watch(CLI::App& app);
void register_worker(CLI::App& app);

/// Subcommands of one task; without a name for those who build the project.
struct CommandTask {
  const char* name;
  std::vector<void (*)(CLI::App&)> commands;
};

/// All subcommands as help and docs/commands.md list them.
inline std::vector<CommandTask> command_tasks() {
  return {{"Check a recording", {register_inspect}},
          {"Map a drive", {register_onboard, register_odometry, register_export}},
          {"Merge drives", {register_merge, register_project}},
          {"Localise", {register_localise}},
          {"Look", {register_view}},
          {"Robots and a base", {register_base, register_watch, register_keys}},
          {"Fleet", {register_fleet, register_worker}},
          {"Simulate and evaluate", {register_simulate, register_evaluate}},
          {nullptr, {register_parameters, register_reference}}};
}

}  // namespace unimapper::apps
