// End-to-end tests of simulated bags: what their folder holds, but for what de-skewing leaves.
#include <cmath>

#include "ports/datasets/dataset.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kScans = 40;

/// A drive as a folder with bags of all kinds in it.
void simulate_drive(const fs::path& folder) {
  (void)run_well({"simulate", "--sensor", "vlp-16", "--scans", std::to_string(kScans), "--seed",
                  "5", "--bag", "mcap,rosbag1,rosbag2", "--extrinsic", "1,0.5,-0.25,2,5,30",
                  "--out", folder});
}

/// Root mean square distance of the same points of two recordings.
double distance_m(const datasets::Dataset& a, const datasets::Dataset& b) {
  datasets::Scan of_a;
  datasets::Scan of_b;
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kScans; ++i) {
    a.read_scan(i, of_a);
    b.read_scan(i, of_b);
    REQUIRE(of_a.points.size() == of_b.points.size());
    for (std::size_t k = 0; k < of_a.points.size(); ++k) {
      const auto& p = of_a.points[k];
      const auto& q = of_b.points[k];
      sum += static_cast<double>(
          (Eigen::Vector3f(p.x, p.y, p.z) - Eigen::Vector3f(q.x, q.y, q.z)).squaredNorm());
    }
    count += of_a.points.size();
  }
  return std::sqrt(sum / static_cast<double>(count));
}

double accuracy(const fs::path& truth, const fs::path& run) {
  const Words evaluate = {"evaluate", "dynamic", "--truth", truth, "--run", run};
  return nlohmann::json::parse(run_well(evaluate).out)["AA"];
}

}  // namespace

TEST_CASE("bags of a drive hold the scans and poses of its folder") {
  const TemporaryDirectory directory;
  const auto folder = directory / "drive";
  simulate_drive(folder);
  const auto expected = datasets::open_dataset(folder);
  for (const char* bag : {"drive.mcap", "drive.bag", "drive"}) {
    INFO(bag);
    const auto dataset = datasets::open_dataset(folder / bag);
    REQUIRE(dataset->scan_count() == kScans);
    for (std::size_t i = 0; i < kScans; ++i) {
      CHECK(dataset->stamp_ns(i) == expected->stamp_ns(i));
      CHECK(dataset->scan_name(i) == expected->scan_name(i));
      const Pose difference = expected->pose(i).inverse() * dataset->pose(i);
      CHECK(difference.translation.norm() < 1e-4);
      CHECK(rotation_angle(difference.rotation) < 1e-5);
    }
    // The folder's own compensation is wrong by 1.5 % of the motion, the poses by their jitter.
    CHECK(distance_m(*dataset, *expected) < 0.04);
    datasets::OpenOptions as_recorded;
    as_recorded.deskew = datasets::Deskew::kOff;
    CHECK(distance_m(*datasets::open_dataset(folder / bag, as_recorded), *expected) > 0.2);
  }
}

TEST_CASE("the map of a bag is that of its folder", "[slow]") {
  const TemporaryDirectory directory;
  const auto folder = directory / "drive";
  simulate_drive(folder);
  const auto run = [&](const fs::path& input, const std::string& name, const Words& options) {
    const fs::path out = directory / name;
    (void)run_well({"onboard", input, "--out", out}, options);
    return out;
  };
  const auto of_folder = run(folder, "of_folder", {});
  // The folder names its sensor.
  const auto of_bag = run(folder / "drive.mcap", "of_bag", {});
  const auto of_raw =
      run(folder / "drive.mcap", "of_raw", {"--sensor", "vlp-16", "--deskew", "off"});
  CHECK(read_json(of_bag / "stats.json")["keyframes"] ==
        read_json(of_folder / "stats.json")["keyframes"]);
  const LabelPairs labels = label_pairs(of_folder, of_bag);
  const double share = static_cast<double>(labels.equal) / static_cast<double>(labels.all);
  const double aa_folder = accuracy(folder, of_folder);
  const double aa_bag = accuracy(folder, of_bag);
  WARN("AA of the folder " << aa_folder << " %, of the bag " << aa_bag << " %, not de-skewed "
                           << accuracy(folder, of_raw) << " %; " << 100.0 * share
                           << " % of the labels are equal");
  CHECK(share > 0.99);
  CHECK(aa_bag > aa_folder - 2.0);
}

TEST_CASE("the up that a bag's accelerometer tells reaches the merger where scans do not show it") {
  const TemporaryDirectory directory;
  const fs::path drive = directory / "drive";
  (void)run_well({"simulate", "--scene", "corridor", "--sensor", "vlp-16", "--scans", "30",
                  "--thin", "8", "--distortion", "--bag", "mcap", "--imu", "--no-odometry", "--out",
                  drive});
  const auto keyframes_up_known = [&](const std::string& name, const Words& options) {
    const fs::path run = directory / name;
    (void)run_well({"onboard", drive / "drive.mcap", "--out", run}, options);
    (void)run_well({"merge", run, "--out", run / "map"});
    const nlohmann::json session = read_json(run / "map/summary.json")["sessions"][0];
    REQUIRE(session["keyframes"] == 3);
    return session["keyframes_up_known"].get<int>();
  };
  CHECK(keyframes_up_known("without", {"--imu-topic", "off"}) == 0);
  CHECK(keyframes_up_known("with", {}) == 3);
}
