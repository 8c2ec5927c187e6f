// End-to-end tests of final and refined labels: files, messages, exit codes.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "ports/datasets/files.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// A recording and a run on it. The small sensor keeps the pipeline's memory small.
struct Fixture {
  explicit Fixture(const std::vector<std::string>& more = {}) {
    recording.write(dataset);
    std::vector<std::string> arguments = {"onboard",    dataset.string(), "--out",
                                          run.string(), "--sensor",       "vlp-16"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult result = run_unimapper(arguments);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
  }
  /// Every scan has a label for every point.
  void check_labels(const fs::path& folder) const {
    const auto files = datasets::list_files(folder / "labels", ".label");
    REQUIRE(files.size() == recording.scans.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
      CHECK(fs::file_size(files[i]) == recording.scans[i].points.size() * sizeof(std::uint32_t));
    }
  }

  TemporaryDirectory directory;
  SmallRecording recording{25};
  fs::path dataset = directory.path() / "recording";
  fs::path run = directory.path() / "run";
  fs::path map = directory.path() / "map";
};

}  // namespace

TEST_CASE("final labels are written on request, for every point of every scan") {
  const Fixture fixture({"--final-labels"});
  fixture.check_labels(fixture.run);
  fixture.check_labels(fixture.run / "final");
  CHECK_FALSE(fs::exists(Fixture().run / "final"));
}

TEST_CASE("a run tells how many labels later keyframes changed, final labels or not") {
  const auto told = [](const Fixture& fixture) {
    return nlohmann::json::parse(read_text(fixture.run / "stats.json"))["relabelled"];
  };
  const Fixture with({"--final-labels"});
  const nlohmann::json relabelled = told(with);
  CHECK(relabelled == told(Fixture()));
  bool differ = false;
  for (const fs::path& file : datasets::list_files(with.run / "labels", ".label")) {
    differ |= read_text(file) != read_text(with.run / "final" / "labels" / file.filename());
  }
  CHECK(differ == (relabelled["share"] > 0.0));
  CHECK((relabelled["cells_now_dynamic"] > 0 || relabelled["cells_now_static"] > 0) == differ);
  CHECK(relabelled["share"] <= 1.0);
}

TEST_CASE("a second run leaves no final labels of the first") {
  const Fixture fixture({"--final-labels"});
  REQUIRE(run_unimapper({"onboard", fixture.dataset.string(), "--out", fixture.run.string(),
                         "--sensor", "vlp-16", "--replace"})
              .exit_code == 0);
  CHECK(datasets::list_files(fixture.run / "final" / "labels", ".label").empty());
}

TEST_CASE("a run reports the bytes of its messages and those of their free-space images") {
  const Fixture fixture;
  const auto stats = nlohmann::json::parse(read_text(fixture.run / "stats.json"));
  const auto& bytes = stats["message_bytes_per_keyframe"];
  CHECK(bytes["free_space_images"] > 0);
  CHECK(bytes["all"] > bytes["free_space_images"]);
}

TEST_CASE("the merger labels a recording again, for every point of every scan") {
  const Fixture fixture;
  const CommandResult merged =
      run_unimapper({"merge", fixture.run.string(), "--out", fixture.map.string(), "--truth",
                     "run=" + fixture.dataset.string(), "--refined-labels"});
  INFO(merged.err);
  REQUIRE(merged.exit_code == 0);
  CHECK_THAT(merged.err, Contains("refined labels of run are in"));
  fixture.check_labels(fixture.map / "refined" / "run");
}

TEST_CASE("scans without a whole keyframe are counted, and all their points are static") {
  const Fixture fixture;
  const fs::path log = fixture.run / "keyframes.lcmlog";
  // Of the last keyframe only the front arrived.
  fs::resize_file(log, fs::file_size(log) - 1000);
  const CommandResult merged =
      run_unimapper({"merge", fixture.run.string(), "--out", fixture.map.string(), "--truth",
                     "run=" + fixture.dataset.string(), "--refined-labels"});
  INFO(merged.err);
  REQUIRE(merged.exit_code == 0);
  CHECK_THAT(merged.err, Contains("scans of run are in no whole keyframe"));
  fixture.check_labels(fixture.map / "refined" / "run");
}

TEST_CASE("refined labels do not depend on the voxels of the map") {
  const TemporaryDirectory directory;
  SmallRecording recording(25);
  for (datasets::Scan& scan : recording.scans) {
    // Who walks beside the robot, and enough of the wall behind to see that he has left.
    for (float z = -2.0F; z <= 2.0F; z += 0.1F) {
      for (float x = -10.0F; x <= 10.0F; x += 0.1F) scan.points.push_back({x, 6.0F, z, 0.5F});
      if (z > -0.2F) continue;
      for (float x = 2.0F; x < 2.5F; x += 0.1F) scan.points.push_back({x, 4.0F, z, 0.9F});
    }
  }
  recording.write(directory / "recording");
  REQUIRE(run_unimapper({"onboard", (directory / "recording").string(), "--out",
                         (directory / "run").string(), "--sensor", "vlp-16"})
              .exit_code == 0);
  const auto labels_with = [&directory](const std::string& voxel_size_m) {
    const fs::path config = directory / "config.json";
    const fs::path map = directory / "map";
    write_text(config, R"({"map": {"voxel_size_m": )" + voxel_size_m + "}}");
    REQUIRE(run_unimapper({"merge", (directory / "run").string(), "--out", map.string(), "--truth",
                           "run=" + (directory / "recording").string(), "--refined-labels",
                           "--config", config.string(), "--replace"})
                .exit_code == 0);
    std::string labels;
    for (const fs::path& file :
         datasets::list_files(map / "refined" / "run" / "labels", ".label")) {
      labels += read_text(file);
    }
    return labels;
  };
  const std::string labels = labels_with("0.2");
  REQUIRE(labels.find('\xFB') != std::string::npos);  // 251: the walker is dynamic
  CHECK((labels_with("0.05") == labels));
}

TEST_CASE("a recording that the session was not made of is refused") {
  const Fixture fixture;
  const fs::path other = fixture.directory.path() / "other";
  SmallRecording(4).write(other);
  const CommandResult merged =
      run_unimapper({"merge", fixture.run.string(), "--out", fixture.map.string(), "--truth",
                     "run=" + other.string(), "--refined-labels"});
  CHECK(merged.exit_code == 1);
  CHECK_THAT(merged.err,
             Contains("the session was made of another one") || Contains("unimapper: error"));
}
