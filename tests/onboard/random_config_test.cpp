// Random configurations: refusal with a message, or a run.
#include "run.hpp"
#include "tests/random_parameters.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

class RandomConfig {
 public:
  explicit RandomConfig(std::uint32_t seed) : random_(seed) {}

  /// A small configuration of which a few members are anything at all.
  PipelineConfig next() {
    PipelineConfig config = small_config();
    config.clock_ns = clock;
    config.keyframe.max_points_per_scan = 4096;
    config.voxel.max_cells = 8192;
    config.voxel.max_window_blocks = 8192;
    config.voxel.max_voxels = 2048;
    config.descriptor.max_voxels = 2048;
    config.loop_search.max_places = 8;
    config.loop_search.max_matches = 4096;
    random_.change_some(kCheckedParameters<PipelineConfig>, &config);
    return config;
  }

 private:
  static std::int64_t clock() {
    static std::int64_t now_ns = 0;
    return now_ns += 50'000;
  }

  RandomParameters random_;
};

/// Everything a caller may do, with scans that move, jump, are empty or not finite.
void run(const PipelineConfig& config, const std::vector<LabelledScan>& scans) {
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  std::vector<PointLabel> labels(scans.front().points.size());
  std::uint64_t keyframes = 0;
  std::uint64_t accepted = 0;
  const auto look = [&] {
    const KeyframeView& view = pipeline->keyframe();
    ++keyframes;
    REQUIRE(view.scans.size() <= config.keyframe.scans);
    REQUIRE(view.static_cells.size() + view.dynamic_cells.size() <= config.voxel.max_cells);
    REQUIRE(view.place.keypoints.size() <= config.descriptor.max_keypoints);
    REQUIRE(view.place.planes.size() <= config.descriptor.max_planes);
    for (std::size_t s = 0; s < view.scans.size(); ++s) (void)pipeline->labels(s, labels);
  };
  const std::size_t count = std::min<std::size_t>(2 * config.keyframe.scans + 1, 12);
  for (std::size_t i = 0; i < count; ++i) {
    const LabelledScan& scan = scans[i % scans.size()];
    const Pose pose = sensor_at(0.4 * static_cast<double>(i), 0.0, 0.02 * static_cast<double>(i));
    const ScanResult result =
        pipeline->add_scan(scan.view(), pose, static_cast<std::int64_t>(i + 1) * kPeriodNs);
    accepted += result.error.code == ErrorCode::kOk ? 1 : 0;
    if (result.keyframe_ready) look();
  }
  if (pipeline->flush().keyframe_ready) look();
  while (pipeline->relabel_next())
    (void)pipeline->relabel(scans[0].view(), sensor_at(0, 0), labels);
  // A configured range may leave no point of any scan.
  CHECK((keyframes > 0) == (accepted > 0));
}

}  // namespace

TEST_CASE("a random configuration is refused in words or runs a small scene", "[slow]") {
  Scene scene;
  scene.columns = 90;
  scene.boxes = {standing_box({8.0, 6.0, 1.5}, {6.0, 0.3, 1.5}),
                 standing_box({-7.0, -2.0, 2.0}, {1.0, 5.0, 2.0}),
                 moving_box({8.0, -4.0, 0.9}, {0.0, 1.4, 0.0}, {0.25, 0.25, 0.9})};
  std::vector<LabelledScan> scans;
  for (int i = 0; i < 12; ++i) {
    scans.push_back(scene.scan(sensor_at(0.4 * i, 0.0, 0.02 * i), 0.1 * i));
  }
  RandomConfig random(20251122);
  std::size_t refused = 0;
  std::size_t ran = 0;
  std::size_t large = 0;
  constexpr std::size_t kRuns = 3000;
  for (std::size_t i = 0; i < kRuns; ++i) {
    const PipelineConfig config = random.next();
    CAPTURE(i);
    const Error error = config.validate();
    const std::size_t bytes = Pipeline::required_bytes(config);
    if (error.code != ErrorCode::kOk) {
      ++refused;
      REQUIRE(error.code == ErrorCode::kInvalidConfig);
      REQUIRE(names_a_parameter(kCheckedParameters<PipelineConfig>, error.message));
      REQUIRE(bytes == 0);
      continue;
    }
    constexpr std::size_t kMostBytes = 24'000'000;  // what takes longer to clear than to use
    if (bytes > kMostBytes) {
      ++large;
      continue;
    }
    run(config, scans);
    ++ran;
  }
  INFO(refused << " refused, " << ran << " ran, " << large << " too large");
  CHECK(refused > kRuns / 5);
  CHECK(ran > kRuns / 5);
  CHECK(large < kRuns / 3);
}
