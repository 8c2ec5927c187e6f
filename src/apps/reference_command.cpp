// `unimapper reference`: all commands and options as the Markdown of docs/commands.md
#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "src/apps/commands.hpp"

namespace unimapper::apps {
namespace {

constexpr const char* kCommandsPageHead =
    "# Commands\n\n"
    "Printed by `unimapper reference` from the program's own options; a test fails where this "
    "file\n"
    "differs. `unimapper COMMAND --help` prints the same of one command. A group of options that\n"
    "several commands have stands at the first of them. Exit codes: 0 success, 1 failure or\n"
    "something left out, 2 wrong usage.\n";

/// `text` in a cell of a table.
std::string table_cell(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '|') {
      result += "\\|";
    } else if (c == '\n') {
      result += "<br>";
    } else {
      result += c;
    }
  }
  return result;
}

class Reference {
 public:
  /// The commands of `app` by task, with a table of contents before.
  void print(const CLI::App& app) {
    const auto shown = app.get_subcommands(is_shown);
    std::cout << "\n| task | commands |\n|---|---|";
    std::string task;
    for (const CLI::App* command : shown) {
      if (command->get_group() != task)
        std::cout << (task.empty() ? "\n| " : " |\n| ") << (task = command->get_group()) << " |";
      std::cout << " [" << command->get_name() << "](#unimapper-" << command->get_name() << ")";
    }
    std::cout << " |\n";
    for (const CLI::App* command : shown) {
      if (command->get_group() != task)
        std::cout << "\n## " << (task = command->get_group()) << '\n';
      print(*command, "unimapper " + command->get_name());
    }
  }

 private:
  static bool is_shown(const CLI::App* command) { return !command->get_group().empty(); }

  /// `command` and those below it.
  void print(const CLI::App& command, const std::string& name) {
    std::cout << "\n### " << name << "\n\n" << command.get_description() << ".\n";
    std::string usage = name;
    for (const CLI::Option* option : options_of(command)) {
      if (option->get_positional()) usage += " " + option->get_name(true);
    }
    const auto below = command.get_subcommands(is_shown);
    // Those without a name are options of which one is to be given.
    const auto is_named = [](const CLI::App* next) { return !next->get_name().empty(); };
    if (std::none_of(below.begin(), below.end(), is_named)) {
      std::cout << "\n    " << usage << " [OPTIONS]\n";
    }
    for (const std::string& group : groups_of(command)) print_group(command, group, name);
    for (const CLI::App* next : below) {
      if (is_named(next)) {
        print(*next, name + " " + next->get_name());
      } else {
        print_table(next->get_description(), options_of(*next));
      }
    }
  }

  static std::vector<const CLI::Option*> options_of(const CLI::App& command) {
    return command.get_options([](const CLI::Option* option) {
      return !option->get_group().empty() && !option->check_lname("help");
    });
  }

  static std::vector<std::string> groups_of(const CLI::App& command) {
    std::vector<std::string> groups;
    for (const std::string& group : command.get_groups()) {
      if (!group.empty()) groups.push_back(group);
    }
    return groups;
  }

  void print_group(const CLI::App& command, const std::string& group, const std::string& name) {
    std::vector<const CLI::Option*> members;
    for (const CLI::Option* option : options_of(command)) {
      if (option->get_group() == group) members.push_back(option);
    }
    if (members.empty()) return;
    const bool is_shared = group != "Options";
    if (is_shared) {
      const auto [first, is_new] = first_with_.try_emplace(group, name);
      if (!is_new) {
        std::cout << "\n*" << group << "*: as of `" << first->second << "`.\n";
        return;
      }
    }
    print_table(is_shared ? group : "option", members);
  }

  static void print_table(const std::string& head, const std::vector<const CLI::Option*>& members) {
    std::cout << "\n| " << head << " | |\n|---|---|\n";
    const CLI::Formatter formatter;
    for (const CLI::Option* option : members) {
      const bool is_positional = option->get_positional();
      std::cout << "| `" << formatter.make_option_name(option, is_positional)
                << table_cell(formatter.make_option_opts(option)) << "` | "
                << table_cell(option->get_description()) << " |\n";
    }
  }

  std::map<std::string, std::string> first_with_;  ///< group of options: the first command with it
};

}  // namespace

void register_reference(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("reference", "Print docs/commands.md");
  command->group("");  // for those who build the project
  command->callback([&app] {
    std::cout << kCommandsPageHead;
    Reference().print(app);
  });
}

}  // namespace unimapper::apps
