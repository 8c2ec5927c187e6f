// Tests of `unimapper keys`, and of the options that take keys.
#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Contains;

TEST_CASE("keys of a robot are made, listed and revoked") {
  const TemporaryDirectory directory;
  const std::string folder = directory / "keys";
  const std::string robot = directory / "robot7.robot";
  const CommandResult made =
      run_unimapper({"keys", "new", "robot7", "--out", robot, "--keys", folder});
  REQUIRE(made.exit_code == 0);
  CHECK_THAT(made.out, Contains("robot robot7, number ") && Contains("fingerprint "));
  CHECK(std::filesystem::status(robot).permissions() == std::filesystem::perms(0600));
  const std::size_t at = made.out.find("fingerprint ") + 12;
  const std::string fingerprint = made.out.substr(at, 8);
  CHECK_THAT(run_unimapper({"keys", "list", "--keys", folder}).out,
             Contains("robot7") && Contains(fingerprint) && Contains("accepted"));

  REQUIRE(run_unimapper({"keys", "revoke", "robot7", "--keys", folder}).exit_code == 0);
  CHECK_THAT(run_unimapper({"keys", "list", "--keys", folder}).out, Contains("revoked"));
  const CommandResult again = run_unimapper({"keys", "revoke", "robot7", "--keys", folder});
  CHECK(again.exit_code == 1);
  CHECK_THAT(again.err, Contains("revoked already"));
}

TEST_CASE("a key that cannot be listed at the base is not left with the robot") {
  const TemporaryDirectory directory;
  const std::string folder = directory / "keys";
  const auto make = [&](const std::string& file) {
    return run_unimapper({"keys", "new", "robot7", "--out", directory / file, "--keys", folder});
  };
  REQUIRE(make("one").exit_code == 0);
  const CommandResult second = make("two");
  CHECK(second.exit_code == 1);
  CHECK_THAT(second.err, Contains("has a key of robot7 already"));
  CHECK_FALSE(std::filesystem::exists(directory / "two"));
  CHECK(make("one").exit_code == 1);
  CHECK(std::filesystem::exists(directory / "one"));
}

TEST_CASE("a key that others can read starts neither robot nor base") {
  const TemporaryDirectory directory;
  const std::string folder = directory / "keys";
  const std::string robot = directory / "robot7.robot";
  REQUIRE(run_unimapper({"keys", "new", "robot7", "--out", robot, "--keys", folder}).exit_code ==
          0);
  std::filesystem::permissions(robot, std::filesystem::perms(0644));
  const CommandResult onboard =
      run_unimapper({"onboard", directory / "none", "--out", directory / "run", "--key", robot});
  CHECK(onboard.exit_code == 1);
  CHECK_THAT(onboard.err, Contains("has permissions 0644"));
  std::filesystem::permissions(directory / "keys/robot7.key", std::filesystem::perms(0640));
  const CommandResult base = run_unimapper(
      {"base", "--store", directory / "store", "--listen", "memq://", "--keys", folder});
  CHECK(base.exit_code == 1);
  CHECK_THAT(base.err, Contains("has permissions 0640"));
}
