// Entry point of the command-line tool.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>

#include "src/apps/commands.hpp"

namespace {

enum ExitCode { kSuccess = 0, kRuntimeFailure = 1, kUsageError = 2 };

int run(int argc, char** argv) {
  CLI::App app("Scans in, one merged map out: onboard processing and map merging for LiDARs");
  app.name("unimapper");
  app.set_version_flag("--version", "unimapper " UNIMAPPER_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Example:\n"
      "  unimapper onboard recordings/monday --sensor os2-128 --out runs/monday\n"
      "Every command has a --help of its own.");
  unimapper::apps::register_simulate(app);
  unimapper::apps::register_onboard(app);
  unimapper::apps::register_merge(app);
  unimapper::apps::register_evaluate(app);
  unimapper::apps::register_rt_check(app);
  unimapper::apps::register_parameters(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version arrive here too, with exit code 0.
    if (error.get_exit_code() == 0) return app.exit(error);
    std::cerr << "unimapper: error: " << error.what() << "\nSee unimapper --help.\n";
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
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::cout.flush();
    std::cerr << "unimapper: error: " << one_line(error.what()) << '\n';
    return kRuntimeFailure;
  }
}
