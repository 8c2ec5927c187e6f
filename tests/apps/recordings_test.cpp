// End-to-end test of `unimapper onboard` on the labelled real sequence, if it is there.
#include "tests/recordings.hpp"

#include "ports/datasets/files.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;

TEST_CASE("the labelled real KITTI sequence is processed and its accuracy printed") {
  const auto recording = testing::find_recording("kitti_0005a");
  if (recording.empty()) return;
  const TemporaryDirectory directory;
  const auto run = directory / "kitti";
  (void)run_well({"onboard", recording, "--out", run});
  const auto stats = read_json(run / "stats.json");
  CHECK(stats["scans"] == 70);
  CHECK(stats["keyframes"] == 7);
  CHECK(stats["scans_refused"].empty());
  CHECK(stats["allocations_after_start"] == 0);
  for (const auto& scan : datasets::list_files(recording / "velodyne", ".bin")) {
    const auto labels = run / "labels" / scan.filename().replace_extension(".label");
    REQUIRE(std::filesystem::file_size(labels) == std::filesystem::file_size(scan) / 4);
  }

  const auto points = nlohmann::json::parse(
      run_well({"evaluate", "dynamic", "--truth", recording, "--run", run}).out);
  WARN("kitti_0005a per point: SA " << points["SA"] << " %, DA " << points["DA"] << " %, AA "
                                    << points["AA"] << " %");
  for (const char* figure : {"SA", "DA", "AA"}) CHECK(points[figure].is_number());
}
