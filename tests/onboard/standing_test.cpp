// Keyframes of a robot that stands: which are kept, and what their labels are
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

constexpr std::uint32_t kWindow = 5;
constexpr std::uint32_t kScans = 2;

PipelineConfig standing_config() {
  PipelineConfig config = small_config();
  config.removal.window = kWindow;
  config.keyframe.scans = kScans;
  return config;
}

/// A yard with a wall, posts, and `boxes`.
Scene yard(const std::vector<Box>& boxes = {}) {
  Scene scene;
  scene.columns = 360;
  scene.boxes.push_back(standing_box({0.0, 9.0, 2.5}, {60.0, 0.3, 2.5}));
  for (int i = -3; i < 4; ++i) {
    scene.boxes.push_back(standing_box({3.0 * i, -7.0, 1.5}, {0.4, 0.4, 1.5}));
  }
  scene.boxes.insert(scene.boxes.end(), boxes.begin(), boxes.end());
  return scene;
}

struct Closed {
  std::uint32_t sequence = 0;
  bool repeats = false;
  bool is_finished = false;
  Score score;
  std::vector<PointLabel> labels;
};

using Path = std::function<Pose(double)>;
Pose stands(double /*t*/) { return sensor_at(0.0, 0.0); }

/// Keyframes of a robot that moves by `path`, ten scans a second, of which some may be left out.
std::vector<Closed> run(
    const Scene& scene, int keyframes, const Path& path = stands,
    const PipelineConfig& config = standing_config(),
    const std::function<bool(std::size_t)>& takes = [](std::size_t) { return true; }) {
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  std::vector<LabelledScan> scans;
  std::vector<Closed> closed;
  const auto take = [&](const ScanResult& result) {
    if (result.keyframe_ready) {
      const KeyframeView& view = pipeline->keyframe();
      Closed& one = closed.emplace_back();
      one.sequence = view.sequence;
      one.repeats = view.repeats;
      for (std::size_t s = 0; s < view.scans.size(); ++s) {
        const LabelledScan& scan = scans[view.scans[s].scan_index];
        std::vector<PointLabel> labels(scan.points.size());
        REQUIRE(pipeline->labels(s, labels) == labels.size());
        one.score.add(scan, labels);
        one.labels.insert(one.labels.end(), labels.begin(), labels.end());
      }
    }
    if (!result.keyframe_finished) return;
    for (Closed& one : closed) {
      const bool is_it = one.sequence == pipeline->finished_keyframe().sequence && !one.repeats;
      one.is_finished = one.is_finished || is_it;
    }
  };
  for (int i = 0; i < keyframes * static_cast<int>(kScans); ++i) {
    const double t = 0.1 * i;
    if (!takes(static_cast<std::size_t>(i) / kScans)) continue;
    scans.push_back(scene.scan(path(t), t));
    std::mt19937 random(static_cast<unsigned>(i));
    std::normal_distribution<float> noise_m(0.0F, 0.02F);
    for (Eigen::Vector3f& point : scans.back().points) {
      point *= 1.0F + noise_m(random) / point.norm();
    }
    take(pipeline->add_scan(scans.back().view(), path(t), 1 + i * kPeriodNs));
  }
  for (ScanResult last = pipeline->flush(); last.keyframe_ready || last.keyframe_finished;
       last = pipeline->flush()) {
    take(last);
  }
  return closed;
}

std::size_t count_kept(const std::vector<Closed>& closed) {
  return static_cast<std::size_t>(
      std::count_if(closed.begin(), closed.end(), [](const Closed& c) { return !c.repeats; }));
}

/// Seconds at which a keyframe ends.
double end_of(int keyframe) { return 0.1 * kScans * (keyframe + 1); }

}  // namespace

TEST_CASE("a robot that stands keeps as many keyframes as the window holds, and no more") {
  const auto closed = run(yard(), 20);
  for (std::uint32_t k = 0; k < closed.size(); ++k) {
    INFO("keyframe " << k);
    CHECK(closed[k].repeats == (k >= kWindow));
    CHECK(closed[k].is_finished != closed[k].repeats);
    CHECK(closed[k].sequence == std::min(k, kWindow - 1));
    CHECK(closed[k].score.static_percent() > 99.0);
  }
}

TEST_CASE("keyframes are kept again once the robot drives on, and numbered without a gap") {
  const auto closed = run(
      yard(), 20, [](double t) { return sensor_at(t < end_of(14) ? 0.0 : t - end_of(14), 0.0); });
  CHECK(count_kept(closed) == kWindow + 5);
  for (std::uint32_t k = 15; k < 20; ++k) {
    CHECK_FALSE(closed[k].repeats);
    CHECK(closed[k].sequence == kWindow + k - 15);
  }
}

TEST_CASE("a robot that creeps or turns on the spot does not stand") {
  const bool turns = GENERATE(false, true);
  INFO((turns ? "turns" : "creeps"));
  const auto closed = run(yard(), 20, [&](double t) {
    return turns ? sensor_at(0.0, 0.0, 0.2 * t) : sensor_at(0.2 * t, 0.0);
  });
  CHECK(count_kept(closed) == 20);
}

TEST_CASE("whoever stops beside a robot that stands stays dynamic, and nothing else becomes so") {
  // One comes from behind a post once the window is full, and stays; another one walks on.
  const double arrives = end_of(kWindow + 2);
  const Box person{[=](double t) {
                     const double way = std::clamp(2.0 * (t - arrives), 0.0, 4.0);
                     return Eigen::Vector3d(5.0, -12.0 + 2.0 * way, 0.9);
                   },
                   {0.25, 0.25, 0.9},
                   Truth::kDynamic};
  const Box walker = moving_box({-9.0, 5.0, 0.9}, {1.5, 0.0, 0.0}, {0.25, 0.25, 0.9});
  const auto closed = run(yard({person, walker}), 40);
  CHECK(count_kept(closed) < 40 / 2);
  for (std::size_t k = 30; k < closed.size(); ++k) {
    INFO("keyframe " << k);
    CHECK(closed[k].repeats);
    CHECK(closed[k].score.dynamic_percent() > 90.0);
    CHECK(closed[k].score.static_percent() > 99.0);
  }
}

TEST_CASE("labels of a repeat follow from the keyframes that were kept, whatever came between") {
  const Box lorry = moving_box({-14.0, 5.0, 1.5}, {5.0, 0.0, 0.0}, {3.0, 1.0, 1.5});
  constexpr std::size_t kKeyframes = 18;
  const auto all = run(yard({lorry}), kKeyframes);
  REQUIRE(all[kKeyframes - 2].repeats);
  REQUIRE(all.back().repeats);
  const auto kept = run(yard({lorry}), kKeyframes, stands, standing_config(),
                        [&](std::size_t k) { return k + 1 == kKeyframes || !all[k].repeats; });
  CHECK((all.back().labels == kept.back().labels));
}

TEST_CASE("what a lorry lays bare where it stood is kept") {
  const double leaves = end_of(14);
  const Box lorry{[=](double t) { return Eigen::Vector3d(t < leaves ? 0.0 : 1000.0, 6.0, 1.5); },
                  {4.0, 1.2, 1.5},
                  Truth::kStatic};
  const auto closed = run(yard({lorry}), 40);
  CHECK(closed[14].repeats);
  CHECK(count_kept(closed) == kWindow + (kWindow + 1) / 2);
  CHECK(closed.back().repeats);
}

TEST_CASE("deferred work repeats the same keyframes with the same labels") {
  const Box walker = moving_box({-6.0, 4.0, 0.9}, {1.2, 0.0, 0.0}, {0.25, 0.25, 0.9});
  const Path path = [](double t) { return sensor_at(t < end_of(12) ? 0.0 : t - end_of(12), 0.0); };
  const auto at_once = run(yard({walker}), 20, path);
  PipelineConfig config = standing_config();
  config.deferred = true;
  const auto deferred = run(yard({walker}), 20, path, config);
  CHECK(count_kept(at_once) < 16);
  for (std::size_t k = 0; k < at_once.size(); ++k) {
    INFO("keyframe " << k);
    CHECK(deferred[k].sequence == at_once[k].sequence);
    CHECK(deferred[k].repeats == at_once[k].repeats);
    CHECK(deferred[k].is_finished == at_once[k].is_finished);
    CHECK((deferred[k].labels == at_once[k].labels));
  }
}
