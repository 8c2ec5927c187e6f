// Subcommands of the command-line tool.
#pragma once

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
void register_inspect(CLI::App& app);
void register_keys(CLI::App& app);
void register_localise(CLI::App& app);
void register_parameters(CLI::App& app);
void register_reference(CLI::App& app);
void register_view(CLI::App& app);
void register_watch(CLI::App& app);

}  // namespace unimapper::apps
