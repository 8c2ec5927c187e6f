// Tests of static and dynamic accuracy.
#include "src/evaluate/dynamic.hpp"

#include "tests/evaluate/labelled_scan.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::evaluate;
using namespace unimapper::evaluate::testing;
using namespace unimapper::test;

namespace {

/// Straight from the protocol's definition: every point against every kept point.
Tally brute_force_benchmark(MemorySource& source, const BenchmarkConfig& config) {
  std::vector<Eigen::Vector3d> kept;
  const auto visit = [&](auto use) {
    for (const LabelledScan& scan : source.scans) {
      for (std::size_t i = 0; i < scan.points.size(); ++i) {
        if (scan.points[i].norm() >= config.max_range_m) continue;
        use(scan, i, scan.T_world_sensor * scan.points[i].cast<double>());
      }
    }
  };
  visit([&](const LabelledScan& scan, std::size_t i, const Eigen::Vector3d& p) {
    if (!is_removed(scan.predicted[i])) kept.push_back(p);
  });
  Tally tally;
  visit([&](const LabelledScan& scan, std::size_t i, const Eigen::Vector3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& k : kept) nearest = std::min(nearest, (k - p).norm());
    tally.add(truth_of(scan.truth[i]), nearest > static_cast<double>(config.neighbour_m));
  });
  return tally;
}

}  // namespace

TEST_CASE(
    "labels mean what SemanticKITTI says, whatever the instance number; unknown counts as kept") {
  for (std::uint32_t id = 251; id <= 259; ++id) CHECK(truth_of(id) == Truth::kDynamic);
  for (std::uint32_t id : {9U, 10U, 30U, 40U, 80U, 99U, 260U})
    CHECK(truth_of(id) == Truth::kStatic);
  CHECK(truth_of(0) == Truth::kIgnored);
  CHECK(truth_of(1) == Truth::kIgnored);
  CHECK(truth_of((7U << 16U) | 252U) == Truth::kDynamic);
  CHECK(truth_of((7U << 16U) | 0U) == Truth::kIgnored);
  CHECK(class_name(class_of(254)) == "pedestrian");
  CHECK(class_of(254) == class_of(30));
  CHECK(class_name(class_of((3U << 16U) | 253U)) == "cyclist");
  CHECK(class_name(class_of(258)) == "truck");
  CHECK(class_name(class_of(9)) == "unspecified");
  CHECK(class_name(1000) == "unspecified");
  for (std::uint32_t removed : {251U, 252U}) CHECK(is_removed(removed));
  for (std::uint32_t kept : {9U, 0U}) CHECK_FALSE(is_removed(kept));
}

TEST_CASE("accuracies are shares of what should have been kept and removed") {
  Tally tally{10, 9, 4, 1};
  CHECK(tally.static_accuracy() == Approx(0.9));
  CHECK(tally.dynamic_accuracy() == Approx(0.25));
  CHECK(tally.associated_accuracy() == Approx(std::sqrt(0.9 * 0.25)));
  CHECK(tally.harmonic_accuracy() == Approx(2 * 0.9 * 0.25 / 1.15));
  CHECK(std::isnan(Tally{}.static_accuracy()));
  CHECK(std::isnan(Tally{10, 9, 0, 0}.associated_accuracy()));
}

TEST_CASE("per-point accuracy ignores the unlabelled and splits by class and range") {
  MemorySource source;
  LabelledScan scan;
  scan.add({5, 0, 0}, 40, kKept);       // road, right
  scan.add({15, 0, 0}, 80, kRemoved);   // pole, wrong
  scan.add({10, 0, 0}, 254, kRemoved);  // walker, right; 10 m belongs to the second bin
  scan.add({90, 0, 0}, 252, 0);         // car, missed
  scan.add({5, 0, 0}, 0, kRemoved);
  scan.add({5, 0, 0}, 1, kKept);
  scan.add({std::nanf(""), 0, 0}, 40, kRemoved);
  source.scans.push_back(scan);
  const DynamicScore score = score_points(source);
  CHECK(score.ignored == 3);
  CHECK(counts(score.total) == Counts{2, 1, 2, 1});
  CHECK(score.by_class[class_of(80)].static_kept == 0);
  CHECK(score.by_class[class_of(254)].dynamic_removed == 1);
  CHECK(score.by_range[0].static_points == 1);
  CHECK(score.by_range[1].dynamic_points == 1);
  CHECK(score.by_range[kRangeBinCount - 1].dynamic_points == 1);
}

TEST_CASE("a removed point beside a kept one counts as kept by the benchmark") {
  MemorySource source;
  LabelledScan first;
  first.add({10.00F, 0, 0}, 50, kKept);
  first.add({10.04F, 0, 0}, 50, kRemoved);      // not counted: 4 cm from the point above
  first.add({10.00F, 0.06F, 0}, 50, kRemoved);  // 6 cm: lost
  first.add({20, 0, 0}, 252, kRemoved);         // undone by the next scan
  first.add({21, 0, 0}, 252, kRemoved);
  first.add({49.9F, 0, 0}, 50, kKept);
  first.add({50, 0, 0}, 50, kKept);  // at the range limit: ignored
  LabelledScan second;
  second.T_world_sensor.translation = {1000, -500, 2};
  second.add({-980, 500, -2}, 50, kKept);  // too far from its sensor to exist
  LabelledScan third;
  third.T_world_sensor.translation = {15, 0, 0};
  third.add({5.03F, 0, 0}, 50, kKept);
  source.scans = {first, second, third};

  const BenchmarkScore result = score_benchmark(source, {});
  CHECK(counts(result.score.total) == Counts{5, 4, 2, 1});
  CHECK(result.score.by_range[2].dynamic_removed == 1);
}

TEST_CASE("unlabelled points get upstream's treatment in a figure of their own") {
  MemorySource source;
  LabelledScan scan;
  scan.add({2, 0, 0}, 0, kRemoved);   // the robot itself
  scan.add({10, 0, 0}, 1, kRemoved);  // static to upstream
  scan.add({20, 0, 0}, 40, kKept);
  source.scans.push_back(scan);
  const BenchmarkScore result = score_benchmark(source, {});
  CHECK(result.score.ignored == 2);
  CHECK(result.score.total.dynamic_points == 0);
  CHECK(counts(result.with_unlabelled) == Counts{2, 1, 1, 1});
}

TEST_CASE("the benchmark's shortcut equals its definition, in one batch or in many") {
  MemorySource source;
  auto random = [generator = Random(1)]() mutable {
    return static_cast<float>(generator.uniform());
  };
  for (int s = 0; s < 6; ++s) {
    LabelledScan scan;
    scan.T_world_sensor.rotation =
        Eigen::AngleAxisd(0.3 * s, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    scan.T_world_sensor.translation = {-4000.0 + 0.3 * s, 2000.0, 10.0};
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3f point(2 * random(), 2 * random(), 0.3F * random());
      scan.add(point, random() < 0.5F ? 50 : 252, random() < 0.6F ? kRemoved : kKept);
    }
    source.scans.push_back(scan);
  }
  BenchmarkConfig config;
  const Tally expected = brute_force_benchmark(source, config);
  REQUIRE(expected.static_kept > 100);
  REQUIRE(expected.dynamic_removed > 100);
  for (std::size_t batch : {std::size_t{1}, std::size_t{500}, std::size_t{1'000'000}}) {
    config.batch_points = batch;
    CHECK(counts(score_benchmark(source, config).score.total) == counts(expected));
  }
}

TEST_CASE("an empty score gives no figure rather than a good one") {
  MemorySource source;
  CHECK(std::isnan(score_points(source).total.static_accuracy()));
  CHECK(std::isnan(score_benchmark(source, {}).score.total.associated_accuracy()));
}

TEST_CASE("objects that stood while they were seen are told from those that moved") {
  MemorySource source;
  for (int i = 0; i < 10; ++i) {
    LabelledScan scan;
    scan.T_world_sensor.translation = {1000.0 + 0.5 * i, -300.0, 0.0};  // the sensor moves
    for (int k = 0; k < 5; ++k) {
      const float k_m = 0.2F * static_cast<float>(k);
      const float back_m = 0.5F * static_cast<float>(i);
      // Three objects of five cells: one stands, one drives 1 m a scan, one has no instance.
      scan.add({10.1F + k_m - back_m, 2.1F, 0.1F}, 252U | (7U << 16U), k == 0 ? kRemoved : kKept);
      scan.add({10.1F + k_m + back_m, 5.1F, 0.1F}, 252U | (8U << 16U), kRemoved);
      scan.add({10.1F + k_m - back_m, 8.1F, 0.1F}, 254U, kKept);
      scan.add({30.1F, k_m, 0.1F}, 50U | (9U << 16U), kRemoved);  // static: not an object's point
    }
    source.scans.push_back(scan);
  }
  const MotionScore score = score_by_motion(source);
  CHECK(counts(score.standing) == Counts{0, 0, 50, 10});
  CHECK(counts(score.moving) == Counts{0, 0, 100, 50});
  // Of the cars only the one that drives counts as moving.
  CHECK(counts(score.moving_by_class[class_of(252)]) == Counts{0, 0, 50, 50});
  CHECK(score.moving_by_class[class_of(254)].dynamic_removed == 0);
  // Seen in three scans only: motion undefined.
  source.scans.resize(3);
  CHECK(score_by_motion(source).standing.dynamic_points == 0);
}

TEST_CASE("objects count as dynamic from when they begin to move after they were first seen") {
  MemorySource source;
  for (int i = 0; i < 6; ++i) {
    LabelledScan scan;
    // Stands until scan 2, moves in 3, pauses from 4 on with a static label.
    scan.add({10.0F, 0.0F, 0.0F}, (i < 4 ? 252U : 10U) | (7U << 16U), i >= 3 ? kRemoved : kKept);
    // Moved in scan 0 only, before it was first seen.
    if (i > 0) scan.add({0.0F, 10.0F, 0.0F}, 254U | (8U << 16U), kKept);
    scan.add({0.0F, 20.0F, 0.0F}, 10U | (9U << 16U), kKept);  // parked
    scan.add({0.0F, 30.0F, 0.0F}, 50U, i == 0 ? kRemoved : kKept);
    scan.add({0.0F, 40.0F, 0.0F}, 0U, kKept);
    source.scans.push_back(scan);
  }
  const std::vector<MotionInterval> motions = {{7, 3, 3}, {8, 0, 0}};
  const SinceMotionScore score = score_since_motion(source, motions);
  CHECK(counts(score.since.total) == Counts{12, 11, 3, 3});
  CHECK(score.since.ignored == 6);
  CHECK(score.moving.dynamic_points == 1);
  CHECK(score.paused.dynamic_points == 2);
  CHECK(score.before.dynamic_points == 3 + 5);
  CHECK(score.before.dynamic_removed == 0);
  CHECK(score.since.by_class[class_of(252)].dynamic_points == 3);
  // Without any motion, the dynamic labels are all before it.
  CHECK(score_since_motion(source, {}).since.total.dynamic_points == 0);
}

TEST_CASE("an object that moves unseen between two sightings has begun to move") {
  MemorySource source;
  for (int i = 0; i < 6; ++i) {
    LabelledScan scan;
    if (i == 0 || i == 5) scan.add({10.0F, 0.0F, 0.0F}, 30U | (7U << 16U), kKept);
    source.scans.push_back(scan);
  }
  const std::vector<MotionInterval> motions = {{7, 2, 3}};
  const SinceMotionScore score = score_since_motion(source, motions);
  CHECK(score.since.total.static_points == 1);
  CHECK(score.paused.dynamic_points == 1);
}

TEST_CASE("an object seen ever less stands still if its remaining points stay") {
  // A bus fills thirty cells in the scan where it is seen best, and three in the other: all three
  // were filled before. It stands, whether it comes into view or leaves it.
  const bool leaves = GENERATE(false, true);
  MemorySource source;
  for (int s = 0; s < 5; ++s) {
    const bool well_seen = leaves ? s == 0 : s == 4;
    LabelledScan scan;
    for (int cell = 0; cell < (well_seen ? 30 : 3); ++cell) {
      scan.add({10.2F, 0.4F * static_cast<float>(cell) + 0.2F, 0.2F}, (7U << 16U) | 257U, kKept);
    }
    source.scans.push_back(scan);
  }
  CHECK(score_by_motion(source).standing.dynamic_points == 42);
  // Of three cells none may be common if it moved on.
  for (Eigen::Vector3f& point : source.scans[leaves ? 4 : 0].points) point.y() -= 4.0F;
  CHECK(score_by_motion(source).moving.dynamic_points == 42);
}
