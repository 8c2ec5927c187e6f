// Keyframes of a tilted sensor in a leaning, turned odometry frame, the same on every platform
#include "expected_text.hpp"
#include "onboard_words.hpp"
#include "tests/onboard/stream_checksum.hpp"
#include "tests/test.hpp"
#include "tilted_town.hpp"
#include "unimapper/core/event_ring.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

using namespace unimapper;
using namespace unimapper::regression;
using unimapper::test::StreamChecksum;

namespace {

/// Short keyframes, a short window, and loops to what was seen a little while ago.
PipelineConfig short_run(PipelineConfig config) {
  config.keyframe.scans = 4;
  config.free_space.images_per_keyframe = 2;
  config.removal.window = 5;
  config.voxel.max_cells = std::min(config.voxel.max_cells, 1U << 16U);
  config.voxel.max_window_blocks = std::min(config.voxel.max_window_blocks, 1U << 16U);
  config.loop_search.max_places = 32;
  config.search_scope.min_keyframe_gap = 3;
  return config;
}

using Edit = std::function<void(std::int64_t, TownScan&, std::int64_t&)>;

/// Drives through the town; `edit` may change scan, pose and stamp.
std::string run(const PipelineConfig& config, const IntegerTown& town, const Frames& frames,
                std::int64_t scans, const Edit& edit = {}) {
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  StreamChecksum sum(config);
  std::string text;
  std::vector<TownScan> given;
  std::vector<std::vector<PointLabel>> labels;
  const auto finish = [&] {
    const KeyframeView& view = pipeline->keyframe();
    sum.add(*pipeline);
    text += keyframe_text(view);
    labels.resize(given.size());
    for (std::size_t s = 0; s < view.scans.size(); ++s) {
      const std::uint32_t index = view.scans[s].scan_index;
      labels[index].resize(given[index].xyz.size() / 3);
      labels[index].resize(pipeline->labels(s, labels[index]));
    }
  };
  for (std::int64_t i = 0; i < scans; ++i) {
    TownScan scan = frames.apply(town.scan(i));
    std::int64_t stamp_ns = 1 + i * 100000000;
    if (edit) edit(i, scan, stamp_ns);
    given.push_back(scan);
    const ScanResult result = pipeline->add_scan(scan.view(), scan.T_odometry_sensor, stamp_ns);
    if (!result.error.ok()) {
      text += line_of("scan", i, "refused:", result.error.message);
    }
    if (result.keyframe_ready) finish();
  }
  if (pipeline->flush().keyframe_ready) finish();
  // The last labels of all: every scan of a keyframe that is still in the window.
  std::uint32_t relabelled = 0;
  std::size_t changed = 0;
  while (pipeline->relabel_next()) {
    const RelabelledKeyframe& last = pipeline->keyframe().relabelled;
    ++relabelled;
    const std::size_t first = static_cast<std::size_t>(last.sequence) * config.keyframe.scans;
    for (std::size_t s = first; s < first + config.keyframe.scans && s < given.size(); ++s) {
      if (labels.size() <= s || labels[s].empty()) continue;
      changed += pipeline->relabel(given[s].view(), given[s].T_odometry_sensor, labels[s]);
    }
    text += relabelled_text("at the end relabelled", last);
  }
  text += line_of("relabelled", relabelled, "labels changed", changed);
  static_assert(static_cast<std::size_t>(test::StreamPart::kPoses) == 0);
  const auto sums = sum.checksums();
  // Poses, those of loops too, are above in words: their last bits may be those of this program's
  // own copies of Eigen's functions, which vectorise.
  for (std::size_t i = 1; i < test::kStreamParts; ++i) {
    if (i == static_cast<std::size_t>(test::StreamPart::kLoops)) continue;
    text += line_of("checksum of", test::kStreamPartNames[i], hexadecimal(sums[i]));
  }
  return text;
}

}  // namespace

TEST_CASE("tilted spinning sensor, as before on every platform", "[regression]") {
  PipelineConfig config = short_run(preset(SensorKind::kHdl64e));
  config.ground.margin_m = 0.1F;
  config.ground.own_plane_first = false;
  config.ground.propagation_voxels = 1;
  config.removal.log_odds_free = 0.7F;
  config.removal.log_odds_weakly_occupied = 0.3F;
  config.removal.connecting_height_m = 0.5F;
  config.removal.component_dynamic_share = 0.4F;
  config.descriptor.max_keypoints = 80;
  check_expected("onboard_tilted", run(config, IntegerTown(sparse(1)), tilted(), 60));
}

TEST_CASE("tilted sensor that looks ahead, as before on every platform", "[regression]") {
  PipelineConfig config = short_run(preset(SensorKind::kLivoxAvia));
  config.free_space.images_per_keyframe = 4;
  config.free_space.earlier_image_stride = 2;
  config.free_space.own_keyframe = false;
  config.removal.confirmed_static_connects = true;
  config.removal.log_odds_clamp = 0.0F;
  config.odometry.up_sigma_deg = 5.0F;
  IntegerTown::Options options = sparse(2);
  options.only_ahead = true;
  options.points_per_block = 400;
  check_expected("onboard_ahead", run(config, IntegerTown(options), tilted(), 48));
}

TEST_CASE("tilted sensor by the paper's rules, as before on every platform", "[regression]") {
  PipelineConfig config = short_run(paper_preset(SensorKind::kOs1_64));
  config.keyframe.downsample_leaf_m = 0.2F;
  config.keyframe.distance_m = 0.8F;
  config.voxel.fine_size_m = 0.25F;
  config.free_space.visibility = true;
  config.odometry.up_sigma_deg = 6.0F;
  check_expected("onboard_paper", run(config, IntegerTown(sparse(3)), tilted(), 40));
}

TEST_CASE("too much for every capacity, as before on every platform", "[regression]") {
  PipelineConfig config = short_run(preset(SensorKind::kHdl64e));
  config.keyframe.max_points_per_scan = 9000;
  config.voxel.max_cells = 6000;
  config.voxel.max_voxels = 500;
  config.voxel.max_window_blocks = 2600;
  config.descriptor.max_keypoints = 12;
  config.descriptor.max_planes = 40;
  config.descriptor.max_voxels = 100;
  config.loop_search.max_places = 4;
  config.loop_search.max_bucket = 5;
  config.loop_search.max_matches = 64;
  check_expected("onboard_overflow", run(config, IntegerTown(sparse(4)), tilted(), 48));
}

TEST_CASE(
    "too many places and triangles, and an early end of the window, as before on every platform",
    "[regression]") {
  PipelineConfig config = short_run(preset(SensorKind::kHdl64e));
  config.voxel.max_cells = 36000;
  config.voxel.max_window_blocks = 11500;
  config.loop_search.max_places = 4;
  config.loop_search.max_bucket = 5;
  config.loop_search.max_matches = 300;
  config.loop_search.triangles.max_triangles = 400;
  config.odometry.up_sigma_deg = 1.0F;
  check_expected("onboard_crowded", run(config, IntegerTown(sparse(8)), tilted(), 48));
}

TEST_CASE("a window too long for its cells, as before on every platform", "[regression]") {
  PipelineConfig config = short_run(preset(SensorKind::kHdl64e));
  config.keyframe.scans = 2;
  config.removal.window = 28;
  config.voxel.max_cells = 16000;
  config.voxel.max_window_blocks = 60000;
  config.removal.confirmed_static_log_odds = 3.5F;
  config.removal.persistence_share = 0.0F;
  check_expected("onboard_long_window", run(config, IntegerTown(sparse(10)), tilted(), 40));
}

TEST_CASE("faulty scans, jumps and pauses, as before on every platform", "[regression]") {
  PipelineConfig config = short_run(preset(SensorKind::kHdl64e));
  config.keyframe.range_min_m = 3.0F;
  config.keyframe.range_max_m = 40.0F;
  config.keyframe.max_pose_step_m = 5.0F;
  const Frames frames = tilted();
  const Edit edit = [](std::int64_t i, TownScan& scan, std::int64_t& stamp_ns) {
    if (i % 5 == 1) {
      for (std::size_t k = 0; k < 40; ++k) {
        scan.xyz[30 * k + (k % 3)] = k % 2 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                                : std::numeric_limits<float>::infinity();
      }
    }
    if (i == 6) stamp_ns -= 300000000;
    if (i == 10) scan.xyz.clear();
    if (i == 13) scan.T_odometry_sensor.rotation(0, 0) += 0.01;
    if (i == 18) scan.T_odometry_sensor.translation.y() += 30.0;  // a glitch
    if (i >= 25) scan.T_odometry_sensor.translation += Eigen::Vector3d(80.0, -35.0, 6.0);
    if (i >= 33) stamp_ns += 4000000000;
  };
  check_expected("onboard_faults", run(config, IntegerTown(sparse(5)), frames, 44, edit));
}

TEST_CASE("poses that shake, as before on every platform", "[regression]") {
  PipelineConfig config = short_run(preset(SensorKind::kHdl64e));
  config.keyframe.scans = 6;
  config.free_space.images_per_keyframe = 3;
  const Edit edit = [](std::int64_t i, TownScan& scan, std::int64_t&) {
    // Roll and pitch are wrong by up to half a degree.
    const std::int64_t roll = (i * 7) % 5 - 2;
    const std::int64_t pitch = (i * 3) % 7 - 3;
    scan.T_odometry_sensor.rotation =
        product(scan.T_odometry_sensor.rotation, whole_rotation(1000, 2 * roll, 2 * pitch, 0));
  };
  Frames frames = tilted();
  frames.upright_sensor = whole_rotation(60, 1, 2, 11);
  check_expected("onboard_shaking", run(config, IntegerTown(sparse(7)), frames, 60, edit));
}
