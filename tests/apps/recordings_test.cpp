// End-to-end test of `unimapper onboard` on the labelled real sequence, if it is there.
#include "tests/recordings.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "ports/datasets/files.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;

TEST_CASE("the labelled real KITTI sequence is processed and its accuracy printed") {
  const auto recording = testing::find_recording("kitti_0005a");
  if (recording.empty()) return;
  const TemporaryDirectory directory;
  const auto run = directory.path() / "kitti";
  const CommandResult onboard =
      run_unimapper({"onboard", recording.string(), "--out", run.string()});
  INFO(onboard.err);
  REQUIRE(onboard.exit_code == 0);
  const auto stats = nlohmann::json::parse(read_text(run / "stats.json"));
  CHECK(stats["scans"] == 70);
  CHECK(stats["keyframes"] == 7);
  CHECK(stats["scans_refused"].empty());
  CHECK(stats["allocations_after_start"] == 0);
  for (const auto& scan : datasets::list_files(recording / "velodyne", ".bin")) {
    const auto labels = run / "labels" / scan.filename().replace_extension(".label");
    REQUIRE(std::filesystem::file_size(labels) == std::filesystem::file_size(scan) / 4);
  }

  const CommandResult score =
      run_unimapper({"evaluate", "dynamic", "--truth", recording.string(), "--run", run.string()});
  INFO(score.err);
  REQUIRE(score.exit_code == 0);
  const auto points = nlohmann::json::parse(score.out);
  WARN("kitti_0005a per point: SA " << points["SA"] << " %, DA " << points["DA"] << " %, AA "
                                    << points["AA"] << " %");
  CHECK(points["SA"].is_number());
  CHECK(points["DA"].is_number());
  CHECK(points["AA"].is_number());
}
