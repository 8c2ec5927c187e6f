#include "hostile.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "hostile_scans.hpp"
#include "measurement.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::bench {
namespace {

Measurement time_kind(hostile::Kind kind, const PipelineConfig& config, int keyframes) {
  std::vector<hostile::Points> scans;
  for (std::size_t i = 0; i < config.keyframe.scans; ++i) {
    scans.push_back(hostile::scan(kind, config, i));
  }
  OwnedPipeline pipeline(config);
  SplitMeasurement measurement;
  Feeder feeder(*pipeline, config, measurement);
  std::int64_t stamp_ns = 0;
  for (std::uint32_t i = 0; i < feeder.warm_up() + static_cast<std::uint32_t>(keyframes); ++i) {
    for (const hostile::Points& points : scans) {
      const PointView view = PointView::xyz(points.data(), points.size(), sizeof(points[0]));
      feeder.feed({view, Pose{}, ++stamp_ns});
    }
  }
  return measurement.steady;
}

}  // namespace

nlohmann::ordered_json time_hostile_scans(const PipelineConfig& config, double normal_worst_ms,
                                          int keyframes) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  std::fprintf(stderr,
               "\n| hostile scans: ms per keyframe | ingest | removal | total | worst | of the "
               "normal worst | points dropped |\n|---|---|---|---|---|---|---|\n");
  for (const hostile::Kind kind : hostile::kKinds) {
    const Measurement measurement = time_kind(kind, config, keyframes);
    const auto times = [&](Stage stage) {
      return percentiles(measurement.stage_ms[static_cast<std::size_t>(stage)]);
    };
    const double worst_ms = times(Stage::kTotal).max;
    const double ratio = normal_worst_ms > 0.0 ? worst_ms / normal_worst_ms : 0.0;
    std::uint64_t dropped = 0;
    for (const std::uint64_t count : measurement.dropped) dropped += count;
    const double dropped_percent =
        100.0 * static_cast<double>(dropped) / static_cast<double>(measurement.points);
    const std::string name(hostile::name(kind));
    std::fprintf(stderr, "| %s | %.1f | %.1f | %.1f | %.1f | %.2f | %.0f %% |\n", name.c_str(),
                 times(Stage::kIngest).p50, times(Stage::kRemoval).p50, times(Stage::kTotal).p50,
                 worst_ms, ratio, dropped_percent);
    json.push_back({{"scans", name},
                    {"total_ms_p50", times(Stage::kTotal).p50},
                    {"total_ms_max", worst_ms},
                    {"of_normal_worst", ratio},
                    {"dropped_percent", dropped_percent}});
  }
  return json;
}

}  // namespace unimapper::bench
