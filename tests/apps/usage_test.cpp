// End-to-end tests of help, version and usage errors of all commands.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <sstream>

#include "tests/apps/command.hpp"

using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace {

/// The commands in a help text: indented by two, in lower case, before the examples.
Words subcommands(const std::string& help) {
  Words names;
  std::istringstream lines(help);
  std::string heading;
  for (std::string line; std::getline(lines, line) && !line.starts_with("Example");) {
    if (!line.starts_with("  ")) {
      heading = line;
    } else if (std::islower(line[2]) != 0 && heading != "Positionals:") {
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return names;
}

/// Checks the help of a command and of all below it; returns how many there are.
std::size_t check_help(const Words& command) {
  Words arguments = command;
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

}  // namespace

TEST_CASE("every command explains itself with an example") {
  // The tool itself, its thirteen commands and those below them.
  CHECK(check_help({}) >= 14);
}

TEST_CASE("help lists every sensor and every format, and the version is printed") {
  const CommandResult help = run_unimapper({"onboard", "--help"});
  for (const char* name : {"os2-128", "livox-mid-360", "generic", "kitti:", "helipr:"}) {
    CHECK_THAT(help.out, Contains(name));
  }
  CHECK_THAT(run_well({"--version"}).out, Catch::StartsWith("unimapper "));
}

TEST_CASE("results that are printed to a full disk are an error") {
  for (const Words& command : {Words{"--version"}, {"parameters"}, {"onboard", "--help"}}) {
    const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
    REQUIRE(full >= 0);
    int status = 0;
    REQUIRE(waitpid(start(UNIMAPPER_BINARY, command, full, full), &status, 0) > 0);
    close(full);
    CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 1));
  }
}

TEST_CASE("wrong use ends with exit code 2 and says what is wrong") {
  const struct {
    Words arguments;
    const char* message;
  } wrong[] = {
      {{}, "subcommand"},
      {{"fly"}, "subcommand"},
      {{"onboard"}, "DATASET"},
      {{"onboard", "recording"}, "--out"},
      {{"onboard", "r", "--out", "o", "--publish", ""}, "--publish: its value is empty"},
      {{"onboard", "r", "--out=", "--replace"}, "--out: its value is empty"},
      {{"onboard", "recording"}, "See unimapper onboard --help."},
      {{"evaluate", "map"}, "See unimapper evaluate map --help."},
      {{"fly"}, "See unimapper --help."},
      {{"onboard", "recording", "--out"}, "--out"},
      {{"onboard", "r", "--out", "o", "--fast"}, "--fast"},
      {{"onboard", "r", "--out", "o", "--format", "rosbag"}, "rosbag"},
      {{"onboard", "r", "--out", "o", "--preset", "magic"}, "magic"},
      {{"onboard", "r", "--out", "o", "--scans", "0"}, "--scans"},
      {{"onbord", "recording"}, "unknown command 'onbord'; did you mean 'onboard'?"},
      {{"evaluate", "dynamc"}, "did you mean 'dynamic'?"},
      {{"onboard", "r", "--out", "o", "--sensr", "os2-128"}, "did you mean '--sensor'?"},
      {{"onboard", "r", "--out", "o", "--format", "kiti"}, "did you mean 'kitti'?"},
  };
  for (const auto& [arguments, message] : wrong) {
    const CommandResult result = run_unimapper(arguments);
    check_fails(result, message, 2);
    CHECK(result.out.empty());
    CHECK_THAT(result.err, Catch::StartsWith("unimapper: error: "));
  }
}
