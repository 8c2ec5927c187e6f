// Final labels: what later keyframes know, applied to scans labelled before.
#include <cstdio>
#include <map>
#include <unimapper/onboard/owned_pipeline.hpp>
#include <vector>

using namespace unimapper;
struct LabelledScan {
  std::vector<float> points;  // x y z x y z ...
  Pose T_odometry_sensor;
  std::vector<PointLabel> labels;  // online ones first, then final
  PointView view() const { return PointView::xyz(points.data(), points.size() / 3, 12); }
};
int main() {
  OwnedPipeline pipeline(preset(SensorKind::kVlp16));
  if (!pipeline) return std::puts(pipeline.error().message), 1;
  std::vector<LabelledScan> open;                                  // of the keyframe under way
  std::map<std::uint32_t, std::vector<LabelledScan>> by_keyframe;  // whose labels are not final
  const auto relabel = [&] {  // a keyframe was evicted from the window: its evidence is complete
    const RelabelledKeyframe& keyframe = pipeline->keyframe().relabelled;
    if (!keyframe.available) return;
    std::size_t changed = 0;
    for (LabelledScan& scan : by_keyframe[keyframe.sequence])
      changed += pipeline->relabel(scan.view(), scan.T_odometry_sensor, scan.labels);
    by_keyframe.erase(keyframe.sequence);
    std::printf("keyframe %u: %zu labels changed\n", keyframe.sequence, changed);
  };
  for (std::int64_t k = 0; k < 130; ++k) {
    LabelledScan& scan = open.emplace_back();
    for (int i = 0; i < 200; ++i) scan.points.insert(scan.points.end(), {10, 0.1F * i - 10, 0});
    scan.labels.resize(200);
    scan.T_odometry_sensor.translation.x() = 0.05 * static_cast<double>(k);
    if (!pipeline->add_scan(scan.view(), scan.T_odometry_sensor, k * 100'000'000).keyframe_ready)
      continue;
    for (std::size_t s = 0; s < open.size(); ++s) (void)pipeline->labels(s, open[s].labels);
    by_keyframe[pipeline->keyframe().sequence] = std::exchange(open, {});
    relabel();
  }
  while (pipeline->relabel_next()) relabel();  // end of the run: those still in the window
}
