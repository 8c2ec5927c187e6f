// End-to-end tests of what is kept and what is overwritten: runs, maps, simulations, exports.
#include "ports/datasets/files.hpp"
#include "tests/apps/command.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// Every file below `folder` with its content.
Words content(const fs::path& folder) {
  Words all;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) all.push_back(entry.path().string() + read_text(entry.path()));
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// Runs the command, which must fail with `message` and leave `folder` as it is.
void check_kept(const fs::path& folder, const Words& arguments, const std::string& message,
                const Words& more = {}) {
  const Words before = content(folder);
  check_fails(run_unimapper(arguments, more), message);
  CHECK((content(folder) == before));
}

std::size_t count(const fs::path& folder, const char* extension) {
  return datasets::list_files(folder, extension).size();
}

/// A recording with a run of it.
struct Fixture {
  TemporaryDirectory directory;
  fs::path dataset = directory / "run-data";
  fs::path map = directory / "map";
  std::string run = make_run(directory, "run", 12);
};

const Words kReplace = {"--replace"};

/// A drive of so many scans.
Words simulate(const fs::path& out, const char* scans) {
  return {"simulate", "--sensor", "vlp-16", "--thin", "16", "--out", out, "--scans", scans};
}

}  // namespace

TEST_CASE("an earlier map is kept without --replace and leaves nothing with it") {
  const Fixture fixture;
  const Words merge = {"merge", fixture.run, "--out", fixture.map};
  (void)run_well(merge);
  check_kept(fixture.map, merge,
             "holds an earlier map; --replace overwrites it, or choose another --out");
  // A wrong name is told before anything is removed.
  check_kept(fixture.map, {"merge", fixture.run + "s", "--out", fixture.map}, "runs", kReplace);
  write_text(fixture.map / "note.txt", "mine");
  (void)run_well({"merge", make_run(fixture.directory, "b", 12), "--out", fixture.map}, kReplace);
  CHECK(count(fixture.map / "trajectories", ".tum") == 1);
  CHECK(fs::exists(fixture.map / "trajectories/b.tum"));
  CHECK(count(fixture.map / "clouds", ".ply") == 1);
  CHECK(read_text(fixture.map / "note.txt") == "mine");
}

TEST_CASE("a map does not go into a run, nor a run into a map or its own recording") {
  const Fixture fixture;
  check_kept(fixture.run, {"merge", fixture.run, "--out", fixture.run},
             "holds a run, which this would spoil; choose another --out", kReplace);
  (void)run_well({"merge", fixture.run, "--out", fixture.map});
  const Words onboard = {"onboard", fixture.dataset, "--sensor", "vlp-16", "--replace"};
  check_kept(fixture.map, onboard, "holds a map, which this would spoil", {"--out", fixture.map});
  check_kept(fixture.dataset, onboard, "is the recording itself", {"--out", fixture.dataset});
}

TEST_CASE("a run does not go where the scans of its recording lie, nor through a link") {
  const TemporaryDirectory directory;
  const fs::path dataset = directory / "drive";
  SmallRecording(3).write(dataset);
  fs::create_directory_symlink(dataset / "scans", directory / "link");
  for (const fs::path& out : {dataset / "scans", dataset / "scans/", dataset / "scans/run",
                              dataset / "run/../scans", directory / "link"}) {
    INFO(out);
    check_kept(dataset, {"onboard", dataset, "--sensor", "vlp-16"}, "the recording has scans in",
               {"--out", out});
  }
  fs::rename(dataset / "scans", directory / "elsewhere");
  fs::create_directory_symlink(directory / "elsewhere", dataset / "scans");
  for (const fs::path& out : {dataset / "scans", directory / "elsewhere"}) {
    INFO(out);
    check_kept(directory / "elsewhere", {"onboard", dataset, "--sensor", "vlp-16"},
               "the recording has scans in", {"--out", out});
  }
  const fs::path sequence = directory / "root/sequences/00";
  SmallRecording(3).write(sequence);
  check_kept(sequence, {"onboard", directory / "root", "--sensor", "vlp-16"},
             "the recording has scans in", {"--out", sequence});
}

TEST_CASE("a run may go elsewhere below the folder of its recording") {
  const TemporaryDirectory directory;
  const fs::path dataset = directory / "drive";
  SmallRecording(12).write(dataset);
  (void)run_well({"onboard", dataset, "--sensor", "vlp-16", "--out", dataset / "runs/x"});
  CHECK(fs::exists(dataset / "runs/x/run.json"));
}

TEST_CASE("a file for other programs is kept without --replace") {
  const Fixture fixture;
  const std::string mcap = fixture.directory / "map.mcap";
  const Words command = {"export", fixture.run, "--mcap", mcap};
  (void)run_well(command);
  check_kept(fixture.directory.path(), command,
             "map.mcap: exists; --replace overwrites it, or choose another file");
  (void)run_well(command, kReplace);
  const Words merge = {"merge", fixture.run, "--out", fixture.map, "--mcap", mcap};
  check_kept(fixture.directory.path(), merge, "map.mcap: exists");
  (void)run_well(merge, kReplace);
}

TEST_CASE("a device or a folder is never replaced by a file") {
  const Fixture fixture;
  for (const std::string& path : {std::string("/dev/full"), fixture.directory.path().string()}) {
    check_refused(run_unimapper({"export", fixture.run, "--las", path}, kReplace),
                  path + ": is not a file");
  }
}

TEST_CASE("an earlier simulation is kept without --replace and leaves nothing with it") {
  const TemporaryDirectory directory;
  const fs::path out = directory / "drive";
  (void)run_well(simulate(out, "3"), {"--bag", "mcap"});
  REQUIRE(fs::exists(out / "drive.mcap"));
  check_kept(out, simulate(out, "2"), "holds an earlier simulated recording; --replace overwrites");
  (void)run_well(simulate(out, "2"), kReplace);
  CHECK(count(out / "scans", ".bin") == 2);
  CHECK(count(out / "labels", ".label") == 2);
  CHECK_FALSE(fs::exists(out / "drive.mcap"));
  // One that was not simulated is kept even with --replace.
  SmallRecording(3).write(directory / "own");
  check_kept(directory / "own", simulate(directory / "own", "3"),
             "of unknown origin, perhaps a recording of yours", kReplace);
}

TEST_CASE("earlier pictures are kept without --replace") {
  const TemporaryDirectory directory;
  const fs::path drive = directory / "drive";
  const fs::path run = directory / "run";
  const fs::path pictures = directory / "pictures";
  (void)run_well(simulate(drive, "12"));
  (void)run_well({"onboard", drive, "--out", run, "--force"});
  const Words evaluate = {"evaluate", "dynamic", "--truth",    drive,
                          "--run",    run,       "--pictures", pictures};
  (void)run_well(evaluate);
  check_kept(pictures, evaluate, "holds an earlier set of pictures; --replace");
  (void)run_well(evaluate, kReplace);
}
