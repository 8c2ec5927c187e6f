// Recording and run folder for tests of `unimapper onboard`.
#pragma once

#include "ports/datasets/files.hpp"
#include "tests/apps/project.hpp"

namespace unimapper::apps {

namespace fs = std::filesystem;

inline const Words kOutdoors = {"--surroundings", "outdoors"};

/// A recording and a run folder. The small sensor keeps the pipeline's memory small.
struct OnboardRun {
  TemporaryDirectory directory;
  fs::path dataset = directory / "recording";
  fs::path run = directory / "run";

  OnboardRun() = default;
  explicit OnboardRun(const SmallRecording& recording) { recording.write(dataset); }

  [[nodiscard]] Words words() const {
    return {"onboard", dataset, "--out", run, "--sensor", "vlp-16"};
  }
  [[nodiscard]] CommandResult onboard(Words more = {}) const {
    more.emplace_back("--replace");
    return run_unimapper(words(), more);
  }
  /// What a run that must succeed says.
  std::string done(const Words& more = {}) const {
    const CommandResult result = onboard(more);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return result.err;
  }
  [[nodiscard]] nlohmann::json stats() const { return read_json(run / "stats.json"); }
  /// There is a label for every point of every scan.
  void check_labels(const SmallRecording& recording) const {
    const auto files = datasets::list_files(run / "labels", ".label");
    REQUIRE(files.size() == recording.scans.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
      const std::string number = std::to_string(i);
      CHECK(files[i].stem() == std::string(6 - number.size(), '0') + number);
      CHECK(fs::file_size(files[i]) == recording.scans[i].points.size() * sizeof(std::uint32_t));
    }
  }
};

inline void check_refused(const CommandResult& result, const std::string& message) {
  check_fails(result, message);
  const std::size_t error = result.err.find("unimapper: error: ");
  REQUIRE(error != std::string::npos);
  CHECK(result.err.find('\n', error) == result.err.size() - 1);  // one line, the last one
}

}  // namespace unimapper::apps
