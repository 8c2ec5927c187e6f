// End-to-end tests of simulated bags: what their folder holds, but for what de-skewing leaves.
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/files.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;

namespace {

constexpr std::size_t kScans = 40;

/// A drive as a folder with bags of all kinds in it.
void simulate_drive(const std::filesystem::path& folder) {
  const CommandResult result = run_unimapper(
      {"simulate", "--sensor", "vlp-16", "--scans", std::to_string(kScans), "--seed", "5", "--bag",
       "mcap,rosbag1,rosbag2", "--extrinsic", "1,0.5,-0.25,2,5,30", "--out", folder.string()});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
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

double accuracy(const std::filesystem::path& truth, const std::filesystem::path& run) {
  const CommandResult result =
      run_unimapper({"evaluate", "dynamic", "--truth", truth.string(), "--run", run.string()});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  return nlohmann::json::parse(result.out)["AA"];
}

}  // namespace

TEST_CASE("bags of a drive hold the scans and poses of its folder") {
  const TemporaryDirectory directory;
  const auto folder = directory.path() / "drive";
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
  const auto folder = directory.path() / "drive";
  simulate_drive(folder);
  const auto run = [&](const std::string& input, const std::string& name,
                       const std::vector<std::string>& options) {
    const auto out = directory.path() / name;
    std::vector<std::string> arguments = {"onboard", input, "--out", out.string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const CommandResult result = run_unimapper(arguments);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return out;
  };
  const auto of_folder = run(folder.string(), "of_folder", {});
  // The folder names its sensor.
  const std::string mcap = (folder / "drive.mcap").string();
  const auto of_bag = run(mcap, "of_bag", {});
  const auto of_raw = run(mcap, "of_raw", {"--sensor", "vlp-16", "--deskew", "off"});
  const auto folder_stats = nlohmann::json::parse(read_text(of_folder / "stats.json"));
  const auto bag_stats = nlohmann::json::parse(read_text(of_bag / "stats.json"));
  CHECK(bag_stats["keyframes"] == folder_stats["keyframes"]);
  std::size_t points = 0;
  std::size_t equal = 0;
  for (const auto& file : datasets::list_files(of_folder / "labels", ".label")) {
    const std::string a = read_text(file);
    const std::string b = read_text(of_bag / "labels" / file.filename());
    REQUIRE(a.size() == b.size());
    for (std::size_t i = 0; i < a.size(); i += 4) {
      ++points;
      equal += a[i] == b[i] ? 1 : 0;
    }
  }
  const double share = static_cast<double>(equal) / static_cast<double>(points);
  const double aa_folder = accuracy(folder, of_folder);
  const double aa_bag = accuracy(folder, of_bag);
  WARN("AA of the folder " << aa_folder << " %, of the bag " << aa_bag << " %, not de-skewed "
                           << accuracy(folder, of_raw) << " %; " << 100.0 * share
                           << " % of the labels are equal");
  CHECK(share > 0.99);
  CHECK(aa_bag > aa_folder - 2.0);
}
