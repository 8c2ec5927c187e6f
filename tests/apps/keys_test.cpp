// Tests of `unimapper keys`, and of the options that take keys.
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Contains;

namespace {

/// Robot 7's key, and the base's folder of keys.
struct Fixture {
  TemporaryDirectory directory;
  std::string folder = directory / "keys";
  std::string robot = directory / "robot7.robot";

  [[nodiscard]] CommandResult keys(const Words& arguments) const {
    Words all = {"keys"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run_unimapper(all, {"--keys", folder});
  }
  [[nodiscard]] CommandResult make(const std::string& file) const {
    return keys({"new", "robot7", "--out", file});
  }
};

}  // namespace

TEST_CASE("keys of a robot are made, listed and revoked") {
  const Fixture fixture;
  const CommandResult made = fixture.make(fixture.robot);
  REQUIRE(made.exit_code == 0);
  CHECK_THAT(made.out, Contains("robot robot7, number ") && Contains("fingerprint "));
  CHECK(std::filesystem::status(fixture.robot).permissions() == std::filesystem::perms(0600));
  const std::size_t at = made.out.find("fingerprint ") + 12;
  const std::string fingerprint = made.out.substr(at, 8);
  CHECK_THAT(fixture.keys({"list"}).out,
             Contains("robot7") && Contains(fingerprint) && Contains("accepted"));
  REQUIRE(fixture.keys({"revoke", "robot7"}).exit_code == 0);
  CHECK_THAT(fixture.keys({"list"}).out, Contains("revoked"));
  check_fails(fixture.keys({"revoke", "robot7"}), "revoked already");
}

TEST_CASE("a key that cannot be listed at the base is not left with the robot") {
  const Fixture fixture;
  const std::string other = fixture.directory / "other";
  REQUIRE(fixture.make(fixture.robot).exit_code == 0);
  check_fails(fixture.make(other), "has a key of robot7 already");
  CHECK_FALSE(std::filesystem::exists(other));
  CHECK(fixture.make(fixture.robot).exit_code == 1);
  CHECK(std::filesystem::exists(fixture.robot));
}

TEST_CASE("a key that others can read starts neither robot nor base") {
  const Fixture fixture;
  REQUIRE(fixture.make(fixture.robot).exit_code == 0);
  std::filesystem::permissions(fixture.robot, std::filesystem::perms(0644));
  check_fails(run_unimapper({"onboard", fixture.directory / "none", "--out",
                             fixture.directory / "run", "--key", fixture.robot}),
              "has permissions 0644");
  std::filesystem::permissions(fixture.directory / "keys/robot7.key", std::filesystem::perms(0640));
  check_fails(run_unimapper({"base", "--store", fixture.directory / "store", "--listen", "memq://",
                             "--keys", fixture.folder}),
              "has permissions 0640");
}
