// Tests of intensities in cells.
#include <vector>

#include "integer_town.hpp"
#include "run.hpp"
#include "src/core/intensity_sum.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

constexpr std::int64_t kScans = 9;

PipelineConfig three_scans(bool intensity, bool deferred = false) {
  PipelineConfig config = small_config();
  config.keyframe.scans = 3;
  config.intensity = intensity;
  config.deferred = deferred;
  return config;
}

/// Static cells of all keyframes of a drive whose points have the intensity `of` their number,
/// every third byte.
template <typename Of>
std::vector<FineCell> drive(const PipelineConfig& config, const Of& of) {
  const IntegerTown town({});
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  std::vector<FineCell> cells;
  const auto collect = [&](const ScanResult& result) {
    if (!result.keyframe_ready) return;
    const auto view = pipeline->keyframe().static_cells;
    cells.insert(cells.end(), view.begin(), view.end());
  };
  for (std::int64_t i = 0; i < kScans; ++i) {
    const TownScan scan = town.scan(i);
    std::vector<std::uint8_t> bytes(3 * scan.view().count);
    for (std::size_t k = 0; k < scan.view().count; ++k) bytes[3 * k] = of(i, k);
    PointView points = scan.view();
    points.intensities = bytes.data();
    points.intensity_stride = 3;
    collect(pipeline->add_scan(points, scan.T_odometry_sensor, 1 + i * kPeriodNs));
  }
  for (int i = 0; i < 3; ++i) collect(pipeline->flush());
  return cells;
}

std::uint8_t of_scan(std::int64_t scan, std::size_t) { return scan % 3 == 0 ? 10 : 40; }
std::uint8_t of_point(std::int64_t, std::size_t point) {
  return static_cast<std::uint8_t>(point % 200);
}

bool same(const std::vector<FineCell>& a, const std::vector<FineCell>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.position == y.position && x.intensity == y.intensity;
  });
}

}  // namespace

TEST_CASE("Cells carry the mean intensity of their points where that is asked for") {
  std::size_t mixed = 0;
  for (const FineCell& cell : drive(three_scans(true), of_scan)) {
    REQUIRE(cell.intensity >= 10);
    REQUIRE(cell.intensity <= 40);
    if (cell.points == 1) CHECK((cell.intensity == 10 || cell.intensity == 40));
    mixed += cell.intensity != 10 && cell.intensity != 40 ? 1 : 0;
  }
  CHECK(mixed > 100);
}

TEST_CASE("A keyframe has the intensities of its own points alone") {
  const auto of_keyframe = [](std::int64_t scan, std::size_t) -> std::uint8_t {
    return scan < 3 ? 200 : 50;
  };
  for (const FineCell& cell : drive(three_scans(true), of_keyframe)) {
    REQUIRE((cell.intensity == 200 || cell.intensity == 50));
  }
}

TEST_CASE("Intensities change nothing but themselves, and nothing at all if not asked for") {
  std::vector<FineCell> with = drive(three_scans(true), of_point);
  std::vector<FineCell> without = drive(three_scans(false), of_point);
  CHECK(
      std::all_of(without.begin(), without.end(), [](auto& cell) { return cell.intensity == 0; }));
  for (FineCell& cell : with) cell.intensity = 0;
  CHECK(same(with, without));
}

TEST_CASE("Scans that wait keep their intensities") {
  CHECK(same(drive(three_scans(true), of_point), drive(three_scans(true, true), of_point)));
}

TEST_CASE("A point of intensity 0 is known, and one that is thinned out counts") {
  PipelineConfig config = three_scans(true);
  config.keyframe.downsample_leaf_m = 0.2F;
  for (const FineCell& cell : drive(config, [](auto, auto) { return std::uint8_t{0}; })) {
    REQUIRE(cell.intensity == 1);
  }
}

TEST_CASE("The mean of intensities stands still after 4095") {
  IntensitySum sum;
  CHECK(sum.mean() == 0);
  for (int i = 0; i < 4095; ++i) sum.add(255);
  for (int i = 0; i < 4095; ++i) sum.add(1);
  CHECK(sum.mean() == 255);
}
