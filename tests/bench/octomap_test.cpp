// Tests of the OctoMap baseline on recordings with known labels.
#include <catch2/catch.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "bench/dynamic/octomap_baseline.hpp"
#include "ports/datasets/writers.hpp"
#include "src/apps/evaluate/evaluate.hpp"
#include "tests/temporary_directory.hpp"

using namespace unimapper;
using namespace unimapper::bench;

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kScans = 8;
constexpr std::uint32_t kWall = 50;
constexpr std::uint32_t kWalker = 254;

/// A wall 10 m ahead, finely seen; during the first two scans a person stands in front of it. The
/// world is far from its origin, as the world of a real recording may be.
class Street {
 public:
  Street() {
    fs::create_directories(path() / "scans");
    fs::create_directories(path() / "labels");
    Pose pose;
    pose.translation = {450'000, 5'000'000, 30};
    datasets::write_kitti_poses(path() / "poses.txt", std::vector<Pose>(kScans, pose));
    for (std::size_t s = 0; s < kScans; ++s) write_scan(s);
  }
  [[nodiscard]] const fs::path& path() const { return folder_.path(); }
  [[nodiscard]] fs::path run() const { return folder_.path() / "run"; }

 private:
  static std::string name(std::size_t scan) { return "00000" + std::to_string(scan); }

  void write_scan(std::size_t scan) const {
    std::vector<datasets::Scan::Point> points;
    std::vector<std::uint32_t> labels;
    for (int row = -10; row <= 10; ++row) {
      for (int column = -100; column <= 100; ++column) {
        const float y = 0.02F * static_cast<float>(column);
        const float z = 0.05F * static_cast<float>(row);
        const bool is_hidden = scan < 2 && std::abs(column) <= 20;
        const float scale = is_hidden ? 0.5F : 1.0F;
        points.push_back({10.03F * scale, y * scale, z * scale, 0.0F});
        labels.push_back(is_hidden ? kWalker : kWall);
      }
    }
    points.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0, 0});
    labels.push_back(0);
    datasets::write_kitti_scan(path() / "scans" / (name(scan) + ".bin"), points);
    datasets::write_labels(path() / "labels" / (name(scan) + ".label"), labels);
  }

  TemporaryDirectory folder_;
};

nlohmann::json score_of(const Street& street, std::size_t scans = kScans) {
  apps::EvaluateDynamicOptions options{street.path(), street.run()};
  options.scans = scans;
  return nlohmann::json::parse(apps::evaluate_dynamic(options));
}

}  // namespace

TEST_CASE("a wall that stays is static, a person who leaves is removed") {
  const Street street;
  const auto dataset = datasets::open_dataset(street.path());
  const OctomapCost cost = label_with_octomap(*dataset, {}, street.run());
  CHECK(cost.scans == kScans);
  CHECK(cost.cpu_ms > 0.0);
  CHECK(cost.longest_ms <= cost.cpu_ms);
  CHECK(cost.tree_bytes > 0);
  const auto score = score_of(street);
  CHECK(score["SA"] == 100.0);
  CHECK(score["DA"] == 100.0);
  CHECK(score["dynamic_points"].get<int>() == 2 * 21 * 41);
}

TEST_CASE("an object that never leaves stays static") {
  const Street street;
  OctomapOptions options;
  options.scans = 2;
  const auto dataset = datasets::open_dataset(street.path());
  CHECK(label_with_octomap(*dataset, options, street.run()).scans == 2);
  CHECK(score_of(street, 2)["DA"] == 0.0);
}

TEST_CASE("points beyond the range are unknown, and unknown is not dynamic") {
  const Street street;
  OctomapOptions options;
  options.max_range_m = 2.0;
  const auto dataset = datasets::open_dataset(street.path());
  (void)label_with_octomap(*dataset, options, street.run());
  const auto score = score_of(street);
  CHECK(score["SA"] == 100.0);
  CHECK(score["DA"] == 0.0);
}
