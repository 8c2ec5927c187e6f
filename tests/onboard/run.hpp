// Test runs: a pipeline over the scans of a scene, with everything it outputs.
#pragma once

#include <cstdlib>
#include <vector>

#include "scene.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::test {

/// Between two scans.
inline constexpr std::int64_t kPeriodNs = 100'000'000;

/// Small capacities, so that a test takes milliseconds.
inline PipelineConfig small_config() {
  PipelineConfig config = preset(SensorKind::kHdl64e);
  config.keyframe.max_points_per_scan = 40000;
  config.voxel.max_cells = 1U << 16U;
  config.voxel.max_voxels = 1U << 13U;
  config.loop_search.max_places = 20;
  return config;
}

/// One scan per keyframe, so that every scan closes one.
inline PipelineConfig single_scans() {
  PipelineConfig config = small_config();
  config.keyframe.scans = 1;
  config.free_space.images_per_keyframe = 1;
  return config;
}

/// Share of correctly labelled points, in percent, of those that are static / dynamic.
struct Score {
  std::size_t static_points = 0;
  std::size_t static_right = 0;
  std::size_t dynamic_points = 0;
  std::size_t dynamic_right = 0;

  void add(const LabelledScan& scan, const std::vector<PointLabel>& labels) {
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const bool dynamic = scan.truth[i] == Truth::kDynamic;
      const bool right = dynamic == (labels[i] == PointLabel::kDynamic);
      ++(dynamic ? dynamic_points : static_points);
      if (right) ++(dynamic ? dynamic_right : static_right);
    }
  }
  Score& operator+=(const Score& other) {
    static_points += other.static_points;
    static_right += other.static_right;
    dynamic_points += other.dynamic_points;
    dynamic_right += other.dynamic_right;
    return *this;
  }
  [[nodiscard]] double static_percent() const {
    return 100.0 * static_cast<double>(static_right) / static_cast<double>(static_points);
  }
  [[nodiscard]] double dynamic_percent() const {
    return 100.0 * static_cast<double>(dynamic_right) / static_cast<double>(dynamic_points);
  }
};

inline CapacityUse use_of(const KeyframeView& view, Capacity which) {
  return view.statistics->capacity[static_cast<std::size_t>(which)];
}

/// What one keyframe said.
struct KeyframeRun {
  Score score;
  KeyframeStatistics statistics;
  std::vector<std::vector<PointLabel>> labels;
  std::vector<FineCell> static_cells;
  std::vector<FineCell> dynamic_cells;
};

/// Feeds a scene, scan by scan at 10 Hz, as seen from `path`, through a pipeline whose odometry
/// frame is `T_odometry_scene`.
inline std::vector<KeyframeRun> run_scene(const Scene& scene, const PipelineConfig& config,
                                          int scan_count, const std::function<Pose(double)>& path,
                                          const Pose& T_odometry_scene = {}) {
  OwnedPipeline pipeline(config);
  std::vector<LabelledScan> scans;
  std::vector<KeyframeRun> runs;
  const auto collect = [&] {
    const KeyframeView& view = pipeline->keyframe();
    KeyframeRun run;
    run.statistics = *view.statistics;
    run.static_cells.assign(view.static_cells.begin(), view.static_cells.end());
    run.dynamic_cells.assign(view.dynamic_cells.begin(), view.dynamic_cells.end());
    for (std::size_t s = 0; s < view.scans.size(); ++s) {
      const LabelledScan& scan = scans[view.scans[s].scan_index];
      std::vector<PointLabel> labels(scan.points.size());
      if (pipeline->labels(s, labels) != labels.size()) std::abort();
      run.score.add(scan, labels);
      run.labels.push_back(std::move(labels));
    }
    runs.push_back(std::move(run));
  };
  for (int i = 0; i < scan_count; ++i) {
    const double t = 0.1 * i;
    const Pose T_scene_sensor = path(t);
    scans.push_back(scene.scan(T_scene_sensor, t));
    const ScanResult result = pipeline->add_scan(
        scans.back().view(), T_odometry_scene * T_scene_sensor, 1 + i * kPeriodNs);
    if (result.error.code != ErrorCode::kOk) std::abort();
    if (result.keyframe_ready) collect();
  }
  if (pipeline->flush().keyframe_ready) collect();
  return runs;
}

}  // namespace unimapper::test
