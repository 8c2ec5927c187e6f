// Tests of the latency measurement: warm-up, steady state, calls and their percentiles.
#include "bench/latency/drive.hpp"
#include "bench/latency/measurement.hpp"
#include "tests/onboard/run.hpp"
#include "tests/test.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;

/// A recording of the test scene with stamps that are not evenly spaced.
class ShortRecording : public datasets::Dataset {
 public:
  explicit ShortRecording(std::size_t scans) : poses_(scans) {
    const test::Scene scene;
    for (std::size_t i = 0; i < scans; ++i) {
      poses_[i] = test::sensor_at(0.1 * static_cast<double>(i), 0);
      const test::LabelledScan scan = scene.scan(poses_[i], 0.1 * static_cast<double>(i));
      datasets::Scan& stored = scans_.emplace_back();
      for (const auto& point : scan.points) {
        stored.points.push_back({point.x(), point.y(), point.z(), 0.0F});
      }
    }
  }
  std::size_t scan_count() const override { return scans_.size(); }
  void read_scan(std::size_t i, datasets::Scan& scan) const override { scan = scans_[i]; }
  const Pose& pose(std::size_t i) const override { return poses_[i]; }
  std::int64_t stamp_ns(std::size_t i) const override {
    return static_cast<std::int64_t>(1000 + 100'000'000 * i + 1'000'000 * i * i);
  }
  std::string scan_name(std::size_t i) const override { return std::to_string(i); }
  std::vector<std::uint32_t> labels(std::size_t) const override { return {}; }
  std::vector<Pose> ground_truth_poses() const override { return {}; }

 private:
  std::vector<datasets::Scan> scans_;
  std::vector<Pose> poses_;
};

std::int64_t tick() {
  static std::int64_t now_ns = 0;
  return now_ns += 1000;
}

/// `steps` scans of a drive there and back through 15 scans, with a window of two keyframes of
/// five.
SplitMeasurement times_of(std::size_t steps) {
  PipelineConfig config = test::small_config();
  config.removal.window = 2;
  config.keyframe.scans = 5;
  config.clock_ns = tick;
  const Drive drive(ShortRecording(15));
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline.ok());
  SplitMeasurement times;
  Feeder feeder(*pipeline, config, times);
  for (std::size_t step = 0; step < steps; ++step) feeder.feed(drive[step]);
  return times;
}

}  // namespace

TEST_CASE(
    "a drive there and back turns at either end with stamps that rise by the recorded steps") {
  const ShortRecording recording(4);
  const Drive drive(recording);
  std::vector<std::size_t> scans;
  for (std::size_t step = 0; step < 10; ++step) {
    scans.push_back(drive.scan_of(step));
    const TimedScan scan = drive[step];
    CHECK(scan.points.count > 0);
    CHECK(scan.T_odometry_sensor.translation == recording.pose(scans.back()).translation);
    if (step == 0) continue;
    const std::size_t later = std::max(scans[step], scans[step - 1]);
    CHECK(scan.stamp_ns - drive[step - 1].stamp_ns ==
          recording.stamp_ns(later) - recording.stamp_ns(later - 1));
  }
  CHECK(scans == std::vector<std::size_t>{0, 1, 2, 3, 2, 1, 0, 1, 2, 3});
  CHECK(drive[3].stamp_ns == recording.stamp_ns(3));
}

TEST_CASE("calls and keyframes are of the warm-up until a keyframe was evicted from the window") {
  const SplitMeasurement times = times_of(5 * 7 + 2);
  const Measurement& warm_up = times.warm_up;
  const Measurement& steady = times.steady;
  CHECK(warm_up.keyframes() == 3);
  CHECK(steady.keyframes() == 4);
  CHECK(warm_up.calls.size() == 15);
  CHECK(steady.calls.size() == 22);
  CHECK(steady.calls_ms(true).size() == 4);
  CHECK(steady.calls_ms(false).size() == 18);
  CHECK(steady.calls.front().step == 15);
  CHECK(steady.calls.front().keyframe == 3);
  CHECK(steady.calls.back().keyframe == 7);
  for (const Call& call : steady.calls) CHECK(call.ms <= steady.longest_call().ms);
}

TEST_CASE("a drive too short for a steady state has no figures of one") {
  const std::size_t enough = 5 * (3 + kLeastKeyframes);
  const SplitMeasurement too_short = times_of(enough - 1);
  CHECK_FALSE(too_short.is_steady());
  CHECK_THAT(to_table(too_short, "test"), Catch::Contains("| removal | – | – | – | – | ") &&
                                              Catch::Contains("Too short for a steady state"));

  const SplitMeasurement steady = times_of(enough);
  CHECK(steady.is_steady());
  const std::string table = to_table(steady, "test");
  for (const char* row : {"ingest", "removal", "every call", "closing call", "other calls"}) {
    CHECK_THAT(table, Catch::Contains("| " + std::string(row) + " | "));
  }
  CHECK_THAT(table, !Catch::Contains("–") && Catch::Contains("The longest call took"));
}

TEST_CASE("percentiles are samples, the last one the greatest") {
  const Percentiles found = percentiles({4.0, 1.0, 3.0, 2.0, 5.0});
  CHECK(found.p50 == 3.0);
  CHECK(found.p99 == 5.0);
  CHECK(found.max == 5.0);
}
