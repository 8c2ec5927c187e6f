// Tests of the latency measurement: warm-up, steady state, calls and their percentiles.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "bench/latency/drive.hpp"
#include "bench/latency/measurement.hpp"
#include "bench/latency/page_use.hpp"
#include "bench/latency/report.hpp"
#include "tests/onboard/run.hpp"
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
Report report_of(std::size_t steps) {
  Report report;
  report.config = test::small_config();
  report.config.removal.window = 2;
  report.config.keyframe.scans = 5;
  report.config.clock_ns = tick;
  report.title = "test";
  report.there_and_back = true;
  const Drive drive(ShortRecording(15), 100);
  OwnedPipeline pipeline(report.config);
  REQUIRE(pipeline.ok());
  Feeder feeder(*pipeline, report.config, report.times);
  for (std::size_t step = 0; step < steps; ++step) feeder.feed(drive[step]);
  report.recorded = drive.recorded();
  report.steps = steps;
  return report;
}

}  // namespace

TEST_CASE(
    "a drive there and back turns at either end with stamps that rise by the recorded steps") {
  const ShortRecording recording(4);
  const Drive drive(recording, 100);
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

TEST_CASE("a drive of the first scans knows no others") {
  const Drive drive(ShortRecording(9), 3);
  CHECK(drive.recorded() == 3);
  CHECK(drive.scan_of(3) == 1);
}

TEST_CASE("calls and keyframes are of the warm-up until a keyframe was evicted from the window") {
  const Report report = report_of(5 * 7 + 2);
  const Measurement& warm_up = report.times.warm_up;
  const Measurement& steady = report.times.steady;
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
  const Report too_short = report_of(enough - 1);
  CHECK_FALSE(too_short.is_steady());
  CHECK(to_json(too_short)["ms"].empty());
  CHECK(to_json(too_short)["warm_up_ms"]["removal"]["p50"] >= 0.0);
  CHECK_THAT(to_table(too_short), Catch::Contains("Too short for a steady state"));

  const Report steady = report_of(enough);
  CHECK(steady.is_steady());
  const nlohmann::ordered_json json = to_json(steady);
  CHECK(json["drive"] == "there and back");
  for (const char* row : {"ingest", "removal", "every call", "closing call", "other calls"}) {
    for (const char* figure : {"p50", "p90", "p99", "max"}) {
      CHECK(json["ms"][row][figure].is_number());
    }
  }
  CHECK(json["longest_call"]["ms"] == json["ms"]["every call"]["max"]);
  CHECK_THAT(to_table(steady), Catch::Contains("there and back") && Catch::Contains("warm-up"));
}

TEST_CASE("pages that were touched are counted, others not") {
  constexpr std::size_t kPage = 4096;
  OwnMapping memory(300 * kPage);
  for (std::byte& byte : memory.span()) byte = std::byte{1};
  CHECK_FALSE(memory.touched_bytes());
  // The processor marks a page only when it looks it up in the page tables: what it remembers of
  // them must be pushed out. Who else asks the kernel for touched pages takes some away, too.
  std::vector<std::byte> others(16384 * kPage);
  std::size_t touched = 0;
  for (int attempt = 0; attempt < 50 && touched < 10 * kPage; ++attempt) {
    memory.start_counting();
    for (std::size_t at = 0; at < others.size(); at += kPage) {
      others[at] = static_cast<std::byte>(attempt);
    }
    for (std::size_t page = 0; page < 20; ++page) memory.span()[page * 3 * kPage] = std::byte{2};
    const auto counted = memory.touched_bytes();
    if (!counted) {
      WARN("the kernel does not count touched pages here");
      return;
    }
    touched = *counted;
    CHECK(touched < 100 * kPage);
  }
  CHECK(touched >= 10 * kPage);
}
