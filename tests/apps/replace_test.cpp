// End-to-end tests of what is kept and what is overwritten: runs, maps, simulations, exports.
#include <algorithm>
#include <catch2/catch.hpp>

#include "ports/datasets/files.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// Every file below `folder` with its content.
std::vector<std::string> content(const fs::path& folder) {
  std::vector<std::string> all;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) all.push_back(entry.path().string() + read_text(entry.path()));
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// Runs the command into `folder`, which must be refused with `message` and stay as it is.
void check_kept(const fs::path& folder, const std::vector<std::string>& arguments,
                const std::string& message) {
  const std::vector<std::string> before = content(folder);
  const CommandResult result = run_unimapper(arguments);
  INFO(result.err);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, Contains(message));
  CHECK((content(folder) == before));
}

void check_done(std::vector<std::string> arguments, const std::vector<std::string>& more = {}) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  const CommandResult result = run_unimapper(arguments);
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
}

std::size_t count(const fs::path& folder, const char* extension) {
  return datasets::list_files(folder, extension).size();
}

/// A recording with a run of it.
struct Fixture {
  TemporaryDirectory directory;
  fs::path dataset = directory / "recording";
  fs::path run = directory / "run";
  fs::path map = directory / "map";
  fs::path mcap = directory / "map.mcap";

  Fixture() {
    SmallRecording(12).write(dataset);
    check_done({"onboard", dataset.string(), "--out", run.string(), "--sensor", "vlp-16"});
  }
  [[nodiscard]] std::vector<std::string> merge(const std::string& input) const {
    return {"merge", input, "--out", map.string()};
  }
};

std::vector<std::string> simulate(const fs::path& out, const char* scans) {
  return {"simulate", "--sensor", "vlp-16", "--thin", "16",        "--scans",
          scans,      "--bag",    "mcap",   "--out",  out.string()};
}

}  // namespace

TEST_CASE("an earlier map is kept without --replace and leaves nothing with it") {
  const Fixture fixture;
  check_done(fixture.merge(fixture.run.string()));
  check_kept(fixture.map, fixture.merge(fixture.run.string()),
             "holds an earlier map; --replace overwrites it, or choose another --out");
  // A wrong name is told before anything is removed.
  std::vector<std::string> misspelt = fixture.merge(fixture.run.string() + "s");
  misspelt.emplace_back("--replace");
  check_kept(fixture.map, misspelt, "runs");
  check_done({"onboard", fixture.dataset.string(), "--out", (fixture.directory / "b").string(),
              "--sensor", "vlp-16"});
  write_text(fixture.map / "note.txt", "mine");
  check_done(fixture.merge((fixture.directory / "b").string()), {"--replace"});
  CHECK(count(fixture.map / "trajectories", ".tum") == 1);
  CHECK(fs::exists(fixture.map / "trajectories/b.tum"));
  CHECK(count(fixture.map / "clouds", ".ply") == 1);
  CHECK(read_text(fixture.map / "note.txt") == "mine");
}

TEST_CASE("a map does not go into a run, nor a run into a map or its own recording") {
  const Fixture fixture;
  check_kept(fixture.run,
             {"merge", fixture.run.string(), "--out", fixture.run.string(), "--replace"},
             "holds a run, which this would spoil; choose another --out");
  check_done(fixture.merge(fixture.run.string()));
  const std::vector<std::string> onboard = {
      "onboard", fixture.dataset.string(), "--sensor", "vlp-16", "--replace", "--out"};
  const auto onboard_to = [&](const fs::path& out) {
    std::vector<std::string> arguments = onboard;
    arguments.push_back(out.string());
    return arguments;
  };
  check_kept(fixture.map, onboard_to(fixture.map), "holds a map, which this would spoil");
  check_kept(fixture.dataset, onboard_to(fixture.dataset), "is the recording itself");
}

TEST_CASE("a file for other programs is kept without --replace") {
  const Fixture fixture;
  const std::vector<std::string> command = {"export", fixture.run.string(), "--mcap",
                                            fixture.mcap.string()};
  check_done(command);
  check_kept(fixture.directory.path(), command,
             "map.mcap: exists; --replace overwrites it, or choose another file");
  check_done(command, {"--replace"});
  std::vector<std::string> merge = fixture.merge(fixture.run.string());
  merge.insert(merge.end(), {"--mcap", fixture.mcap.string()});
  check_kept(fixture.directory.path(), merge, "map.mcap: exists");
  check_done(merge, {"--replace"});
}

TEST_CASE("an earlier simulation is kept without --replace and leaves nothing with it") {
  const TemporaryDirectory directory;
  const fs::path out = directory / "drive";
  check_done(simulate(out, "3"));
  check_kept(out, simulate(out, "2"), "holds an earlier simulated recording; --replace overwrites");
  std::vector<std::string> without_bag = simulate(out, "2");
  without_bag.erase(without_bag.begin() + 7, without_bag.begin() + 9);
  check_done(without_bag, {"--replace"});
  CHECK(count(out / "scans", ".bin") == 2);
  CHECK(count(out / "labels", ".label") == 2);
  CHECK_FALSE(fs::exists(out / "drive.mcap"));
}

TEST_CASE("a recording that was not simulated is kept even with --replace") {
  const TemporaryDirectory directory;
  SmallRecording(3).write(directory / "drive");
  std::vector<std::string> arguments = simulate(directory / "drive", "3");
  arguments.emplace_back("--replace");
  check_kept(directory.path(), arguments, "of unknown origin, perhaps a recording of yours");
}

TEST_CASE("earlier pictures are kept without --replace") {
  const TemporaryDirectory directory;
  const fs::path drive = directory / "drive";
  const fs::path run = directory / "run";
  check_done(simulate(drive, "12"));
  check_done({"onboard", drive.string(), "--out", run.string(), "--force"});
  const std::vector<std::string> evaluate = {
      "evaluate", "dynamic",    "--truth",    drive.string(),
      "--run",    run.string(), "--pictures", (directory / "pictures").string()};
  check_done(evaluate);
  check_kept(directory / "pictures", evaluate, "holds an earlier set of pictures; --replace");
  check_done(evaluate, {"--replace"});
}
