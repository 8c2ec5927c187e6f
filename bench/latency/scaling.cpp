#include "scaling.hpp"

#include <cstdio>
#include <fstream>
#include <span>
#include <vector>

#include "measurement.hpp"
#include "street.hpp"
#include "unimapper/core/quantile.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::bench {
namespace {

constexpr std::size_t kScans = 10;

double median_of(std::vector<double> values) { return median(std::span(values)); }

/// Median total of a keyframe of `points` points, after the warm-up.
double keyframe_ms(std::size_t points, const PipelineConfig& config) {
  Street street(1);
  std::vector<std::vector<Eigen::Vector3f>> scans;
  for (std::size_t i = 0; i < kScans; ++i) scans.push_back(street.scan(0.0, points / kScans));
  OwnedPipeline pipeline(config);
  SplitMeasurement measurement;
  Feeder feeder(*pipeline, config, measurement);
  std::int64_t stamp_ns = 0;
  for (std::uint32_t keyframe = 0; keyframe < feeder.warm_up() + 9; ++keyframe) {
    for (const auto& scan : scans) {
      const PointView view = PointView::xyz(scan.data(), scan.size(), sizeof(scan[0]));
      feeder.feed({view, Pose{}, ++stamp_ns});
    }
  }
  return median_of(measurement.steady.stage_ms[static_cast<std::size_t>(Stage::kTotal)]);
}

}  // namespace

void measure_points(const std::filesystem::path& folder) {
  PipelineConfig config = preset(SensorKind::kOs2_128);
  config.keyframe.max_points_per_scan = 200000;
  config.clock_ns = processor_time_ns;
  std::ofstream csv(folder / "points.csv");
  csv << "points,ms,ns_per_point\n";
  for (const std::size_t points : {1000U, 2000U, 5000U, 10000U, 20000U, 50000U, 100000U, 200000U,
                                   500000U, 1000000U, 2000000U}) {
    const double ms = keyframe_ms(points, config);
    const double ns_per_point = ms * 1e6 / static_cast<double>(points);
    csv << points << ',' << ms << ',' << ns_per_point << std::endl;
    std::fprintf(stderr, "%zu points: %.2f ms, %.1f ns per point\n", points, ms, ns_per_point);
  }
}

void measure_distance(const std::filesystem::path& folder, int keyframes) {
  constexpr int kBin = 100;
  constexpr double kStep_m = 1.0;
  PipelineConfig config = preset(SensorKind::kVlp16);
  config.clock_ns = processor_time_ns;
  std::ofstream csv(folder / "distance.csv");
  csv << "keyframe,km,total_ms,search_ms\n";
  Street street(2);
  OwnedPipeline pipeline(config);
  SplitMeasurement measurement;
  Feeder feeder(*pipeline, config, measurement);
  Pose pose;
  std::int64_t stamp_ns = 0;
  for (int keyframe = 1; keyframe <= keyframes;) {
    pose.translation.x() += kStep_m;
    const auto scan = street.scan(pose.translation.x(), 500);
    const PointView view = PointView::xyz(scan.data(), scan.size(), sizeof(scan[0]));
    stamp_ns += 100'000'000;
    if (!feeder.feed({view, pose, stamp_ns})) continue;
    if (keyframe++ % kBin != 0) continue;
    const Measurement& bin = measurement.steady;
    csv << keyframe - 1 << ',' << pose.translation.x() * 1e-3 << ','
        << median_of(bin.stage_ms[static_cast<std::size_t>(Stage::kTotal)]) << ','
        << median_of(bin.stage_ms[static_cast<std::size_t>(Stage::kSearch)]) << std::endl;
    measurement = {};
  }
}

}  // namespace unimapper::bench
