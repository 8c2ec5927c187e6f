// Entry point of the command-line tool.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "src/apps/commands.hpp"
#include "src/apps/suggestion.hpp"

namespace {

enum ExitCode { kSuccess = 0, kRuntimeFailure = 1, kUsageError = 2 };

/// The command of `app` that the arguments choose, as deep as they name one.
const CLI::App* chosen_command(const CLI::App& app, int argc, char** argv, int& next) {
  const CLI::App* command = &app;
  for (next = 1; next < argc; ++next) {
    const auto below = command->get_subcommands(
        [&](const CLI::App* candidate) { return candidate->check_name(argv[next]); });
    if (below.empty()) break;
    command = below.front();
  }
  return command;
}

/// "unimapper COMMAND", as deep as the arguments name one.
std::string chosen_name(const CLI::App& app, int argc, char** argv) {
  int next = 1;
  (void)chosen_command(app, argc, argv, next);
  std::string name = "unimapper";
  for (int i = 1; i < next; ++i) name += std::string(" ") + argv[i];
  return name;
}

/// What a mistyped command or option may have meant.
std::string suggestion(const CLI::App& app, int argc, char** argv) {
  int next = 1;
  const CLI::App* command = chosen_command(app, argc, argv, next);
  std::vector<std::string> commands;
  for (const CLI::App* below : command->get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(below->get_name());
  }
  if (!commands.empty() && next < argc && argv[next][0] != '-') {
    return "; unknown command '" + std::string(argv[next]) + "'" +
           unimapper::apps::did_you_mean(argv[next], commands);
  }
  std::vector<std::string> options;
  for (const CLI::Option* option : command->get_options()) {
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  }
  for (int i = next; i < argc; ++i) {
    const std::string typed = std::string(argv[i]).substr(0, std::string(argv[i]).find('='));
    const bool is_known = std::find(options.begin(), options.end(), typed) != options.end();
    if (!typed.starts_with("--") || is_known) continue;
    std::string text = unimapper::apps::did_you_mean(typed, options);
    if (!text.empty()) return text;
  }
  return {};
}

/// The option that is given an empty value, as by a shell's variable that is not set; empty: none.
std::string emptied_option(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view typed = argv[i];
    if (!typed.starts_with("--") || typed.size() < 3) continue;
    if (typed.ends_with('=')) return std::string(typed.substr(0, typed.size() - 1));
    if (i + 1 < argc && argv[i + 1][0] == '\0') return std::string(typed);
  }
  return {};
}

/// All commands by task, as help and docs/commands.md list them.
void add_commands(CLI::App& app) {
  for (const auto& [name, commands] : unimapper::apps::command_tasks()) {
    for (const auto& add : commands) {
      add(app);
      if (name != nullptr) app.get_subcommands({}).back()->group(name);
    }
  }
}

int run(int argc, char** argv) {
  CLI::App app("Scans in, one merged map out: onboard processing and map merging for LiDARs");
  app.name("unimapper");
  app.set_version_flag("--version", "unimapper " UNIMAPPER_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Example:\n"
      "  unimapper onboard recordings/monday --sensor os2-128 --out runs/monday\n"
      "Every command has a --help of its own.");
  add_commands(app);
  try {
    if (const std::string option = emptied_option(argc, argv); !option.empty()) {
      throw CLI::ValidationError(option, "its value is empty: is a variable not set?");
    }
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version arrive here too, with exit code 0.
    if (error.get_exit_code() == 0) return app.exit(error);
    std::cerr << "unimapper: error: " << error.what() << suggestion(app, argc, argv) << "\nSee "
              << chosen_name(app, argc, argv) << " --help.\n";
    return kUsageError;
  }
  return kSuccess;
}

/// Errors are one line, also those of libraries.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int code = run(argc, argv);
    // Results on a disk that is full are not there.
    if (!std::cout.flush() || std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
      throw std::runtime_error("standard output cannot be written");
    }
    return code;
  } catch (const std::exception& error) {
    std::cout.flush();
    std::cerr << "unimapper: error: " << one_line(error.what()) << '\n';
    return kRuntimeFailure;
  }
}
