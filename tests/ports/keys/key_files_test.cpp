// Tests of key files: what was written is read, by its owner alone.
#include "ports/keys/key_files.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::keys;
using Catch::Matchers::Contains;

namespace {

namespace fs = std::filesystem;

bool same(const LinkSecret& a, const LinkSecret& b) {
  return std::equal(a.bytes().begin(), a.bytes().end(), b.bytes().begin());
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void set_mode(const fs::path& path, mode_t mode) { REQUIRE(chmod(path.c_str(), mode) == 0); }

void add_robot(const fs::path& folder, const char* name) {
  add_base_key(folder, base_key_of(new_robot_key(name)));
}

mode_t mode_of(const fs::path& path) {
  struct stat found = {};
  REQUIRE(stat(path.c_str(), &found) == 0);
  return found.st_mode & 07777U;
}

}  // namespace

TEST_CASE("a robot's key comes back from its file, which is its owner's alone") {
  const TemporaryDirectory directory;
  const RobotKey key = new_robot_key("robot-7");
  write_robot_key(directory / "file", key);
  CHECK(mode_of(directory / "file") == 0600);
  const RobotKey read = read_robot_key(directory / "file");
  CHECK(read.name == "robot-7");
  CHECK(read.robot == key.robot);
  CHECK(same(read.link, key.link));
  CHECK(same(read.seed, key.seed));
  CHECK(fingerprint(base_key_of(read)) == fingerprint(base_key_of(key)));
}

TEST_CASE("a key is not overwritten") {
  const TemporaryDirectory directory;
  write_robot_key(directory / "file", new_robot_key("a"));
  const std::string before = text_of(directory / "file");
  CHECK_THROWS_WITH(write_robot_key(directory / "file", new_robot_key("b")),
                    Contains("not overwritten"));
  CHECK(text_of(directory / "file") == before);
  CHECK(std::distance(fs::directory_iterator(directory.path()), {}) == 1);
}

TEST_CASE("a key that others could read is refused") {
  const TemporaryDirectory directory;
  const fs::path file = directory / "file";
  write_robot_key(file, new_robot_key("robot"));
  for (const mode_t mode : {0640, 0604, 0660, 0644, 0620}) {
    set_mode(file, mode);
    CHECK_THROWS_WITH(read_robot_key(file), Contains("permissions") && Contains("chmod 600"));
  }
  set_mode(file, 0400);
  CHECK_NOTHROW(read_robot_key(file));
}

TEST_CASE("a key of another user is refused") {
  const TemporaryDirectory directory;
  const fs::path file = directory / "file";
  write_robot_key(file, new_robot_key("robot"));
  if (chown(file.c_str(), 65534, 65534) != 0) {
    WARN("only root can give a file away");
    return;
  }
  CHECK_THROWS_WITH(read_robot_key(file), Contains("another user"));
}

TEST_CASE("a link to a key, a folder and nothing are no keys") {
  const TemporaryDirectory directory;
  write_robot_key(directory / "file", new_robot_key("robot"));
  fs::create_symlink(directory / "file", directory / "link");
  CHECK_THROWS_WITH(read_robot_key(directory / "link"), Contains("symbolic link"));
  CHECK_THROWS_WITH(read_robot_key(directory.path()), Contains("no key file"));
  CHECK_THROWS_WITH(read_robot_key(directory / "none"), Contains("No such file"));
}

TEST_CASE("a damaged key is refused with its reason") {
  const TemporaryDirectory directory;
  write_robot_key(directory / "file", new_robot_key("robot"));
  const std::string good = text_of(directory / "file");
  const auto refused = [&](const std::string& text) {
    set_mode(directory.write("damaged", text), 0600);
    CHECK_THROWS_AS(read_robot_key(directory / "damaged"), KeyError);
  };
  for (std::size_t length = 0; length < good.size(); ++length) refused(good.substr(0, length));
  refused(good + "more\n");
  refused(good + std::string(5000, 'x'));
  refused(std::string(good).replace(good.find("name robot"), 10, "name ../up"));
  refused(std::string(good).replace(good.find("link ") + 5, 1, "g"));
  // A base's file is none of a robot.
  add_robot(directory / "keys", "robot");
  CHECK_THROWS_WITH(read_robot_key(directory / "keys/robot.key"), Contains("first line"));
}

TEST_CASE("a base's folder lists its robots and knows none of their signing keys") {
  const TemporaryDirectory directory;
  const RobotKey alpha = new_robot_key("alpha");
  const RobotKey beta = new_robot_key("beta");
  add_base_key(directory / "keys", base_key_of(beta));
  add_base_key(directory / "keys", base_key_of(alpha));
  CHECK(mode_of(directory / "keys") == 0700);
  CHECK(mode_of(directory / "keys/alpha.key") == 0600);
  const auto keys = read_base_keys(directory / "keys");
  REQUIRE(keys.size() == 2);
  CHECK(keys[0].name == "alpha");
  CHECK(keys[0].robot == alpha.robot);
  CHECK(same(keys[0].link, alpha.link));
  CHECK(keys[0].verifying == base_key_of(alpha).verifying);
  CHECK_FALSE(keys[0].revoked);
  write_robot_key(directory / "robot", alpha);
  const std::string robot = text_of(directory / "robot");
  const std::string seed = robot.substr(robot.find("seed ") + 5, 64);
  CHECK(text_of(directory / "keys/alpha.key").find(seed) == std::string::npos);
}

TEST_CASE("a revoked key stays known, and its name is not given away again") {
  const TemporaryDirectory directory;
  const fs::path folder = directory / "keys";
  add_robot(folder, "alpha");
  add_robot(folder, "beta");
  revoke_base_key(folder, "alpha");
  const auto keys = read_base_keys(folder);
  REQUIRE(keys.size() == 2);
  CHECK(keys[0].revoked);
  CHECK_FALSE(keys[1].revoked);
  CHECK_THROWS_WITH(revoke_base_key(folder, "alpha"), Contains("revoked already"));
  CHECK_THROWS_WITH(revoke_base_key(folder, "gamma"), Contains("no key of gamma"));
  CHECK_THROWS_WITH(add_robot(folder, "alpha"), Contains("already, revoked"));
}

TEST_CASE("a folder that others may write to is refused, as are two robots of one number") {
  const TemporaryDirectory directory;
  const fs::path folder = directory / "keys";
  const BaseKey alpha = base_key_of(new_robot_key("alpha"));
  add_base_key(folder, alpha);
  set_mode(folder, 0770);
  CHECK_THROWS_WITH(read_base_keys(folder), Contains("permissions"));
  set_mode(folder, 0700);
  BaseKey beta = base_key_of(new_robot_key("beta"));
  beta.robot = alpha.robot;
  CHECK_THROWS_WITH(add_base_key(folder, beta), Contains("number is that of alpha"));
  fs::rename(folder / "alpha.key", folder / "omega.key");
  CHECK_THROWS_WITH(read_base_keys(folder), Contains("holds the key of alpha"));
  CHECK_THROWS_AS(read_base_keys(directory / "none"), KeyError);
}

TEST_CASE("a robot's name is safe as a file name") {
  for (const char* name : {"", "../up", ".hidden", "a b", "a\nrobot 5"}) {
    CHECK_THROWS_AS(new_robot_key(name), KeyError);
  }
}
