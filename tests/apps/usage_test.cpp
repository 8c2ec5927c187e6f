// End-to-end tests of help, version and usage errors of all commands.
#include <catch2/catch.hpp>
#include <sstream>

#include "tests/apps/command.hpp"

using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace {

/// The names below "Subcommands:" of a help text.
std::vector<std::string> subcommands(const std::string& help) {
  std::vector<std::string> names;
  std::istringstream lines(help);
  std::string line;
  bool listed = false;
  while (std::getline(lines, line)) {
    if (line.starts_with("Subcommands:")) {
      listed = true;
    } else if (line.empty() || line[0] != ' ') {
      listed = false;
    } else if (listed && line.size() > 2 && line[2] != ' ') {
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return names;
}

/// Checks the help of a command and of all below it; returns how many there are.
std::size_t check_help(const std::vector<std::string>& command) {
  std::vector<std::string> arguments = command;
  arguments.emplace_back("--help");
  const CommandResult result = run_unimapper(arguments);
  INFO(result.out << result.err);
  CHECK(result.exit_code == 0);
  CHECK(result.err.empty());
  CHECK_THAT(result.out, Contains("Example") && Contains("  unimapper "));
  std::size_t count = 1;
  for (const std::string& name : subcommands(result.out)) {
    arguments.back() = name;
    count += check_help(arguments);
  }
  return count;
}

void check_usage_error(const std::vector<std::string>& arguments, const std::string& message) {
  const CommandResult result = run_unimapper(arguments);
  INFO(result.err);
  CHECK(result.exit_code == 2);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, Catch::StartsWith("unimapper: error: ") && Contains(message));
}

}  // namespace

TEST_CASE("every command explains itself with an example") {
  // The tool itself and its five commands at least.
  CHECK(check_help({}) >= 6);
}

TEST_CASE("help lists every sensor and every format") {
  const CommandResult result = run_unimapper({"onboard", "--help"});
  for (const char* name : {"os2-128", "livox-mid-360", "generic", "kitti:", "helipr:"}) {
    CHECK_THAT(result.out, Contains(name));
  }
}

TEST_CASE("the version is printed") {
  const CommandResult result = run_unimapper({"--version"});
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.out, Catch::StartsWith("unimapper "));
}

TEST_CASE("wrong use ends with exit code 2 and says what is wrong") {
  check_usage_error({}, "subcommand");
  check_usage_error({"fly"}, "subcommand");
  check_usage_error({"onboard"}, "DATASET");
  check_usage_error({"onboard", "recording"}, "--out");
  check_usage_error({"onboard", "recording"}, "See unimapper onboard --help.");
  check_usage_error({"evaluate", "map"}, "See unimapper evaluate map --help.");
  check_usage_error({"fly"}, "See unimapper --help.");
  check_usage_error({"onboard", "recording", "--out"}, "--out");
  check_usage_error({"onboard", "recording", "--out", "run", "--fast"}, "--fast");
  check_usage_error({"onboard", "recording", "--out", "run", "--format", "rosbag"}, "rosbag");
  check_usage_error({"onboard", "recording", "--out", "run", "--preset", "magic"}, "magic");
  check_usage_error({"onboard", "recording", "--out", "run", "--scans", "0"}, "--scans");
  check_usage_error({"onbord", "recording"}, "unknown command 'onbord'; did you mean 'onboard'?");
  check_usage_error({"evaluate", "dynamc"}, "did you mean 'dynamic'?");
  check_usage_error({"onboard", "recording", "--out", "run", "--sensr", "os2-128"},
                    "did you mean '--sensor'?");
  check_usage_error({"onboard", "recording", "--out", "run", "--format", "kiti"},
                    "did you mean 'kitti'?");
}
