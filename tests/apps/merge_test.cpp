// End-to-end tests of `unimapper merge`: exit codes.
#include <catch2/catch.hpp>

#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// Runs of recordings that share nothing the merger could find: they are too short.
struct Fixture {
  TemporaryDirectory directory;

  /// A run of `recording`, called `name`.
  std::string run(const std::string& name, const SmallRecording& recording,
                  const std::vector<std::string>& more = {}) const {
    const fs::path dataset = directory / (name + "-data");
    const fs::path run = directory / name;
    recording.write(dataset);
    std::vector<std::string> arguments{"onboard",    dataset.string(), "--out",
                                       run.string(), "--sensor",       "vlp-16"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    (void)run_unimapper(arguments);
    return run.string();
  }
  CommandResult merge(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "merge");
    arguments.insert(arguments.end(), {"--out", (directory / "map").string(), "--replace"});
    return run_unimapper(arguments);
  }
};

}  // namespace

TEST_CASE("a session left apart is a failure unless it is allowed") {
  const Fixture fixture;
  const std::string a = fixture.run("a", SmallRecording(12));
  const std::string b = fixture.run("b", SmallRecording(14));
  const CommandResult apart = fixture.merge({a, b});
  INFO(apart.err);
  CHECK(apart.exit_code == 1);
  CHECK_THAT(apart.err, Contains("left apart from the map: ") && Contains("--allow-unconnected"));
  // The map of the rest is there all the same.
  CHECK(fs::exists(fixture.directory / "map/report.html"));
  CHECK(fixture.merge({a, b, "--allow-unconnected"}).exit_code == 0);
  CHECK(fixture.merge({a}).exit_code == 0);
}

TEST_CASE("cells of another edge than labels are refined with are warned of") {
  const Fixture fixture;
  const fs::path onboard = fixture.directory / "onboard.json";
  const fs::path base = fixture.directory / "base.json";
  write_text(onboard, R"({"voxel": {"fine_size_m": 0.25, "coarse_size_m": 2.0}})");
  write_text(base, R"({"refinement": {"cell_size_m": 0.25}})");
  const std::string run = fixture.run("a", SmallRecording(12), {"--config", onboard.string()});
  const CommandResult unlike = fixture.merge({run});
  CHECK_THAT(unlike.err, Contains("the cells of session a have an edge of 0.25 m") &&
                             Contains("set refinement.cell_size_m"));
  CHECK_THAT(fixture.merge({run, "--config", base.string()}).err, !Contains("have an edge of"));
  CHECK_THAT(fixture.merge({fixture.run("b", SmallRecording(12))}).err,
             !Contains("have an edge of"));
}

TEST_CASE("what is no run is refused with what to give instead") {
  const Fixture fixture;
  const std::string run = fixture.run("a", SmallRecording(3));
  const CommandResult above = fixture.merge({fixture.directory.path().string()});
  CHECK(above.exit_code == 1);
  CHECK_THAT(above.err, Contains("runs in it: " + run));
  const fs::path recording = fixture.directory / "drive.mcap";
  write_text(recording, "a recording");
  const CommandResult raw = fixture.merge({recording.string()});
  CHECK(raw.exit_code == 1);
  CHECK_THAT(raw.err, Contains("`unimapper onboard` makes a run of it first"));
}

TEST_CASE("a run of which nothing came makes no map") {
  const Fixture fixture;
  SmallRecording recording(2);
  for (auto& scan : recording.scans) {
    for (auto& point : scan.points) point.x += 10000.0F;  // out of range
  }
  const CommandResult empty = fixture.merge({fixture.run("a", recording)});
  INFO(empty.err);
  CHECK(empty.exit_code == 1);
}
