// `unimapper keys`: the command line of src/apps/keys.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "src/apps/commands.hpp"
#include "src/apps/keys/run_keys.hpp"

namespace unimapper::apps {

namespace {

struct KeysOptions {
  std::string name;
  std::filesystem::path out;
  std::filesystem::path keys;
};

void add_folder_option(CLI::App& command, KeysOptions& options) {
  command.add_option("--keys", options.keys, "The base's folder of keys")->required();
}

}  // namespace

void register_keys(CLI::App& app) {
  auto options = std::make_shared<KeysOptions>();
  CLI::App* command = app.add_subcommand(
      "keys", "Make, list and revoke the keys that authenticate robots (docs/security.md)");
  command->require_subcommand(1);
  CLI::App* make = command->add_subcommand("new", "Keys for one more robot");
  make->add_option("NAME", options->name, "Name of the robot")->required();
  make->add_option("--out", options->out, "New file for the robot's part")->required();
  add_folder_option(*make, *options);
  make->callback([options] { new_key(options->name, options->out, options->keys, std::cout); });
  CLI::App* list = command->add_subcommand("list", "The robots of a base");
  add_folder_option(*list, *options);
  list->callback([options] { list_keys(options->keys, std::cout); });
  CLI::App* revoke = command->add_subcommand("revoke", "Take nothing of a robot any more");
  revoke->add_option("NAME", options->name, "Name of the robot")->required();
  add_folder_option(*revoke, *options);
  revoke->callback([options] { revoke_key(options->name, options->keys, std::cout); });
  command->footer(
      "Example:\n"
      "  unimapper keys new robot7 --out robot7.robot --keys keys\n"
      "  unimapper onboard recording --out run --key robot7.robot --publish URL\n"
      "  unimapper base --store site --listen URL --keys keys");
}

}  // namespace unimapper::apps
