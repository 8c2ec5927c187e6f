// End-to-end tests of `unimapper map`: a project that is stored, change by change.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <random>

#include "ports/store/keyframe_store.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

Words names(const Project& project) {
  Words names;
  const nlohmann::json shown = project.show();
  for (const auto& session : shown["sessions"]) names.push_back(session["name"]);
  return names;
}

std::int64_t epochs(const Project& project) {
  store::StoreReader reader(project.store);
  return static_cast<std::int64_t>(reader.project().epochs().size());
}

nlohmann::json listed(const Project& project) {
  return nlohmann::json::parse(project.done({"list", "--json"}).out)["epochs"];
}

/// Files of an exported map that are the same for the same map.
std::vector<std::string> map_files(const fs::path& folder) {
  std::vector<std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (!entry.is_regular_file() || name == "timing.json" || name == "report.html" ||
        name == "view/times.json") {
      continue;
    }
    all.push_back(name + read_text(entry.path()));
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// The files of the map that `unimapper merge` makes of these.
std::vector<std::string> merged_files(const Project& project, const Words& inputs) {
  const fs::path out = project.directory / "merged";
  (void)run_well({"merge", "--allow-unconnected", "--replace", "--out", out}, inputs);
  return map_files(out);
}

/// Starts a command and kills it after so many milliseconds; true if it had ended before.
bool kill_after(const Words& arguments, int milliseconds) {
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  const pid_t process = start(UNIMAPPER_BINARY, arguments, nowhere, nowhere);
  close(nowhere);
  usleep(static_cast<useconds_t>(1000 * milliseconds));
  kill(process, SIGKILL);
  int status = 0;
  REQUIRE(waitpid(process, &status, 0) == process);
  return WIFEXITED(status);
}

}  // namespace

TEST_CASE("a stored project exports what unimapper merge writes", "[slow]") {
  const Project project;
  const std::string a = project.run("a", 12);
  const std::string b = project.run("b", 34);
  const fs::path map = project.directory / "map";
  CHECK_THAT(project.done({"add", a, b}).out, Contains("epoch 1: added a (") && Contains("b ("));
  CHECK(names(project) == Words{"a", "b"});
  project.refused({"export", "--out", project.store, "--replace"}, "holds a store");
  project.refused({"export", "--out", map},
                  "there is no map in epoch 1; `unimapper map merge` makes one");
  CHECK_THAT(project.done({"merge"}).out, Contains("epoch 2: merged "));
  const std::vector<std::string> wanted = merged_files(project, {a, b});
  CHECK((map_files(project.exported("map")) == wanted));
  // What was verified once is not again, and the map is the same, however little memory there is.
  const CommandResult again = project.done({"merge", "--memory", "1", "--threads", "3"});
  CHECK_THAT(again.err, Contains(" 0 loops verified, ") || Contains("unimapper: 0 loops verified"));
  CHECK((map_files(project.exported("map", {"--memory", "1", "--replace"})) == wanted));
  CHECK((merged_files(project, {project.store, "--memory", "1"}) == wanted));

  // A removed session leaves no file behind.
  project.done({"remove", "a"});
  CHECK(names(project) == Words{"b"});
  project.refused({"export", "--out", map, "--replace"}, "there is no map in epoch 4");
  project.done({"merge"});
  project.exported("map", {"--replace"});
  CHECK_FALSE(fs::exists(map / "unconnected/a.tum"));
  CHECK_FALSE(fs::exists(map / "trajectories/a.tum"));
  // The earlier map is still there to be had.
  CHECK((map_files(project.exported("earlier", {"--epoch", "3"})) == wanted));
}

TEST_CASE("the same run twice is one run, another content of it none") {
  const Project project;
  const std::string a = project.run("a", 12);
  project.done({"add", a});
  const CommandResult again = project.done({"add", a});
  CHECK_THAT(again.out, Contains("session a is there already") && Contains("nothing changed"));
  CHECK(epochs(project) == 1);
  fs::rename(a, project.directory / "other-name");
  CHECK_THAT(project.done({"add", project.directory / "other-name"}).out,
             Contains("nothing changed"));
  CHECK(names(project) == Words{"a"});
  // Removed, it is taken in again.
  project.done({"remove", "a"});
  CHECK(names(project).empty());
  project.done({"add", project.directory / "other-name"});
  CHECK(names(project) == Words{"a"});
  project.refused({"add", project.directory / "nowhere"}, "does not exist");
  project.refused({"add", project.directory.path()}, "holds no keyframes.lcmlog");
}

TEST_CASE("what people say is kept, numbered and withdrawn") {
  const Project project;
  project.done({"add", project.run("a", 12), project.run("b", 34)});
  CHECK_THAT(project.done({"pin", "a"}).out, Contains("reference session a"));
  project.done({"pin", "b"});
  project.done({"apart", "a"});
  CHECK_THAT(project.done({"forbid", "b:0", "b:2"}).out, Contains("the map has no such loop"));
  project.done({"link", "b:2", "b:0", "--pose", "1", "2", "3", "0", "0", "0", "1", "--force"});
  const nlohmann::json said = project.statements();
  REQUIRE(said.size() == 4);
  CHECK(said[0]["kind"] == "reference");
  CHECK(said[0]["session"] == "b");
  CHECK(said[1]["kind"] == "apart");
  CHECK(said[2]["kind"] == "forbidden");
  CHECK(said[3]["kind"] == "link");
  CHECK(said[3]["query"] == "b:2");
  CHECK(said[3]["has_pose"] == true);
  // They contradict each other, which the merge says.
  project.refused({"merge"}, "a link contradicts another statement");
  project.done({"withdraw", std::to_string(said[3]["statement"].get<int>())});
  project.done({"merge"});
  const nlohmann::json shown = project.show();
  CHECK(shown["sessions"][0]["reason"] == "kept apart by a person");
  CHECK(shown["sessions"][1]["state"] == "central");
  CHECK(shown["statements"].size() == 3);

  project.refused({"withdraw", "99"}, "there is no statement 99");
  project.refused({"pin", "nobody"}, "there is no session \"nobody\", but there are: a, b");
  project.refused({"forbid", "a:0", "b:99"}, "there is no keyframe b:99");
  project.refused({"forbid", "a", "b:1"}, "\"a\" is no keyframe: write SESSION:NUMBER");
  project.refused({"link", "a:0", "a:0"}, "these are one keyframe");
  project.refused({"link", "a:0", "b:3"}, "the scans of the two do not fit at one position");
  project.done({"link", "a:0", "b:3", "--force"});
  project.refused({"link", "a:0", "b:0", "--pose", "1", "2", "3", "0", "0", "0", "9"},
                  "no unit quaternion");
}

TEST_CASE("an undo goes back step by step, and to any epoch, and loses nothing") {
  const Project project;
  project.refused({"undo"}, "there is nothing to undo");
  project.done({"add", project.run("a", 12)});
  project.done({"add", project.run("b", 34)});
  project.done({"pin", "a"});
  CHECK_THAT(project.done({"undo"}).out, Contains("epoch 4: went back to epoch 2"));
  CHECK(project.statements().empty());
  CHECK(names(project) == Words{"a", "b"});
  project.done({"undo"});
  CHECK(names(project) == Words{"a"});
  project.done({"undo"});
  CHECK(names(project).empty());
  project.refused({"undo"}, "there is nothing to undo");
  CHECK_THAT(project.done({"undo", "--epoch", "3"}).out, Contains("in effect there: 1 statement"));
  CHECK(names(project) == Words{"a", "b"});
  CHECK(project.statements().size() == 1);
  const std::string first = project.done({"show", "--json", "--epoch", "1"}).out;
  CHECK(nlohmann::json::parse(first)["sessions"].size() == 1);
  project.refused({"undo", "--epoch", "99"}, "has no epoch 99");
  CHECK(epochs(project) == 7);
  CHECK(listed(project).size() == 7);
  CHECK(listed(project)[6]["outcome"] == "went back to epoch 3");
}

TEST_CASE("a session that is removed for good takes the epochs that show it with it") {
  const Project project;
  const std::string a = project.run("a", 12);
  const std::string b = project.run("b", 34);
  project.done({"add", a});
  project.done({"add", b});
  project.done({"merge"});
  project.done({"pin", "b"});
  const auto bytes_before = fs::file_size(store::database_of(project.store));
  CHECK_THAT(project.done({"remove", "--purge", "b"}).out, Contains("epoch 5: removed for good b"));
  CHECK(fs::file_size(store::database_of(project.store)) < bytes_before);
  CHECK(names(project) == Words{"a"});
  CHECK(project.statements().empty());
  CHECK_FALSE(listed(project)[0].contains("purged_by"));
  CHECK(listed(project)[2]["purged_by"] == 5);
  CHECK_THAT(project.done({"list"}).out,
             Contains("(gone: epoch 5 removed a session of it for good)"));
  const std::string why =
      "epoch 3 cannot be shown or gone back to: epoch 5 removed a session of it";
  project.refused({"show", "--epoch", "3"}, why);
  project.refused({"undo", "--epoch", "3"}, why);
  project.refused({"export", "--epoch", "3", "--out", project.directory / "map"}, why);
  project.refused({"undo"}, "epoch 4 cannot be shown or gone back to");
  project.refused({"remove", "--purge", "b"}, "there is no session \"b\", but there are: a");
  project.done({"undo", "--epoch", "1"});
  // Its run is taken in anew.
  project.done({"add", b});
  CHECK(names(project) == Words{"a", "b"});
  project.refused({"show", "--epoch", "3"}, why);
}

TEST_CASE("while a base runs, a project is read and not changed, and the other way round") {
  const Project project;
  const std::string a = project.run("a", 12);
  project.done({"add", a});
  {
    const store::KeyframeStore base(project.store);
    project.refused({"add", a}, "a base writes to this store (process ");
    project.refused({"merge"}, "a base writes to this store (process ");
    project.done({"show"});
    project.done({"list"});
    project.done({"check"});
  }
  project.done({"merge"});
  const store::KeyframeStore base(project.store);
  project.exported("map");
}

TEST_CASE("a map is exported with tiles and a grid, and later without them") {
  const Project project;
  project.done({"add", project.run("a", 12)});
  project.done({"merge"});
  const fs::path out = project.exported("map", {"--tile", "20", "--grid", "0.25"});
  CHECK_THAT(read_text(out / "grid.yaml"), Contains("resolution: 0.25"));
  CHECK(read_text(out / "grid.pgm").find('\xFE') != std::string::npos);
  CHECK_FALSE(fs::is_empty(out / "tiles"));
  project.exported("map", {"--replace", "--box", "0", "0", "-9", "9", "9", "9", "--voxel", "0.5"});
  CHECK_FALSE(fs::exists(out / "grid.yaml"));
  CHECK_FALSE(fs::exists(out / "tiles"));
  project.refused({"export", "--out", out, "--replace", "--box", "0", "0", "0", "9", "-9", "9"}, "",
                  2);
  project.refused({"export", "--out", out, "--grid-height", "1"}, "", 2);
}

TEST_CASE("mistakes with a project are told in words") {
  const TemporaryDirectory directory;
  const std::string nowhere = directory / "nowhere";
  for (const char* command : {"merge", "show", "list", "check", "undo"}) {
    check_fails(run_unimapper({"map", command, "--store", nowhere}), "is no store");
  }
  CHECK_FALSE(fs::exists(nowhere));
  CHECK(run_unimapper({"map", "merge"}).exit_code == 2);
  CHECK(run_unimapper({"map"}).exit_code == 2);
  const Project project;
  project.refused({"create"}, "is a store already");
  project.refused({"merge"}, "the project has no session");
  CHECK_THAT(project.done({"check"}).out, Contains("every page, keyframe and epoch is sound"));
  store::Database(store::database_of(project.store), store::Access::kWrite)
      .run("INSERT INTO results (parameters) VALUES ('{}')");
  const CommandResult damaged = run_unimapper(project.words({"check"}));
  CHECK(damaged.exit_code == 1);
  CHECK_THAT(damaged.out, Contains("a result belongs to no epoch"));
}

TEST_CASE("commands that are killed at any moment leave the last epoch whole", "[slow]") {
  const Project project;
  const std::string a = project.run("a", 12);
  const std::string b = project.run("b", 34);
  std::mt19937 random(7);
  project.done({"add", a});
  const auto start = std::chrono::steady_clock::now();
  project.done({"merge"});
  const std::chrono::duration<double, std::milli> of_merge =
      std::chrono::steady_clock::now() - start;
  const fs::path out = project.exported("map");
  // Within what the longest of them takes here.
  const auto latest_ms = static_cast<std::uint32_t>(std::max(of_merge.count(), 20.0));
  const std::vector<Words> commands = {
      {"add", b}, {"merge"}, {"export", "--replace", "--out", out}, {"remove", "b"}};
  int killed = 0;
  for (int round = 0; round < 40; ++round) {
    const std::int64_t before = epochs(project);
    const Words& command = commands[static_cast<std::size_t>(round) % 4];
    const bool ended = kill_after(project.words(command), static_cast<int>(random() % latest_ms));
    killed += ended ? 0 : 1;
    INFO(command.front() << ", round " << round);
    REQUIRE(store::StoreReader(project.store).check().empty());
    REQUIRE(epochs(project) - before <= 1);
    project.done({"show"});
    // A whole map of one or two sessions, and no other.
    const bool has_b =
        fs::exists(out / "trajectories/b.tum") || fs::exists(out / "unconnected/b.tum");
    const auto summary = read_json(out / "summary.json");
    REQUIRE(summary["sessions"].size() == (has_b ? 2U : 1U));
    REQUIRE(fs::file_size(out / "map.ply") >= summary["map"]["points"].get<std::size_t>() * 19);
    REQUIRE(fs::exists(out / "report.html"));
  }
  CHECK(killed > 10);
  project.done({"add", b});
  project.done({"merge"});
  CHECK((map_files(project.exported("map", {"--replace"})) == merged_files(project, {a, b})));
  CHECK(names(project) == Words{"a", "b"});
}
