// End-to-end tests of final and refined labels: files, messages, exit codes.
#include "ports/datasets/files.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// A recording and a run on it.
struct Fixture {
  explicit Fixture(const Words& more = {}) { make_run(directory, "run", recording, more); }

  /// Every scan has a label for every point.
  void check_labels(const fs::path& folder) const {
    const auto files = datasets::list_files(folder / "labels", ".label");
    REQUIRE(files.size() == recording.scans.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
      CHECK(fs::file_size(files[i]) == recording.scans[i].points.size() * sizeof(std::uint32_t));
    }
  }
  [[nodiscard]] CommandResult merge(const fs::path& truth) const {
    return run_unimapper(
        {"merge", run, "--out", map, "--truth", "run=" + truth.string(), "--refined-labels"});
  }
  [[nodiscard]] nlohmann::json stats() const { return read_json(run / "stats.json"); }

  TemporaryDirectory directory;
  SmallRecording recording{25};
  fs::path dataset = directory / "run-data";
  fs::path run = directory / "run";
  fs::path map = directory / "map";
};

}  // namespace

TEST_CASE("final labels are written on request, and how many labels changed is told without, too") {
  const Fixture with({"--final-labels"});
  with.check_labels(with.run);
  with.check_labels(with.run / "final");
  const Fixture without;
  CHECK_FALSE(fs::exists(without.run / "final"));
  const nlohmann::json relabelled = with.stats()["relabelled"];
  CHECK(relabelled == without.stats()["relabelled"]);
  bool differ = false;
  for (const fs::path& file : datasets::list_files(with.run / "labels", ".label")) {
    differ |= read_text(file) != read_text(with.run / "final" / "labels" / file.filename());
  }
  CHECK(differ == (relabelled["share"] > 0.0));
  CHECK((relabelled["cells_now_dynamic"] > 0 || relabelled["cells_now_static"] > 0) == differ);
  CHECK(relabelled["share"] <= 1.0);
  // A second run leaves no final labels of the first.
  (void)run_well({"onboard", with.dataset, "--out", with.run, "--sensor", "vlp-16", "--replace"});
  CHECK(datasets::list_files(with.run / "final" / "labels", ".label").empty());
}

TEST_CASE("a run reports the bytes of its messages and those of their free-space images") {
  const nlohmann::json bytes = Fixture().stats()["message_bytes_per_keyframe"];
  CHECK(bytes["free_space_images"] > 0);
  CHECK(bytes["all"] > bytes["free_space_images"]);
}

TEST_CASE("the merger labels every point again, those of no whole keyframe as static") {
  const Fixture fixture;
  const auto refined_labels_are_said = [&](const char* message) {
    const CommandResult merged = fixture.merge(fixture.dataset);
    INFO(merged.err);
    REQUIRE(merged.exit_code == 0);
    CHECK_THAT(merged.err, Contains(message));
    fixture.check_labels(fixture.map / "refined" / "run");
  };
  refined_labels_are_said("refined labels of run are in");
  fs::remove_all(fixture.map);
  // Of the last keyframe only the front arrived.
  const fs::path log = fixture.run / "keyframes.lcmlog";
  fs::resize_file(log, fs::file_size(log) - 1000);
  refined_labels_are_said("scans of run are in no whole keyframe");
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
  const std::string run = make_run(directory, "run", recording);
  const auto labels_with = [&](const std::string& voxel_size_m) {
    const std::string config =
        directory.write("config.json", R"({"map": {"voxel_size_m": )" + voxel_size_m + "}}");
    const fs::path map = directory / "map";
    (void)run_well({"merge", run, "--out", map, "--truth", "run=" + run + "-data",
                    "--refined-labels", "--config", config, "--replace"});
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
  SmallRecording(4).write(fixture.directory / "other");
  const CommandResult merged = fixture.merge(fixture.directory / "other");
  CHECK(merged.exit_code == 1);
  CHECK_THAT(merged.err,
             Contains("the session was made of another one") || Contains("unimapper: error"));
}
