// Sampling of spinning sensors measured from scans, and images that follow it
#include "run.hpp"
#include "src/onboard/sampling/sampling_estimator.hpp"
#include "src/onboard/sampling/sampling_monitor.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

namespace {

constexpr double kRadian = 3.14159265358979 / 180.0;

Pose pitched(double pitch_deg, double roll_deg = 0.0) {
  return {(Eigen::AngleAxisd(pitch_deg * kRadian, Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(roll_deg * kRadian, Eigen::Vector3d::UnitX()))
              .toRotationMatrix(),
          Eigen::Vector3d::Zero()};
}

std::vector<double> even_rings(int count, double low_deg, double high_deg) {
  std::vector<double> rings;
  for (int i = 0; i < count; ++i) rings.push_back(low_deg + (high_deg - low_deg) * i / (count - 1));
  return rings;
}

/// A scan between ground, a ceiling of sky without returns and walls all around, its axis tilted by
/// roll and pitch in the points' frame. Beams jitter by a hundredth of a degree.
std::vector<Eigen::Vector3f> scan_of(const std::vector<double>& rings, int columns,
                                     double roll_deg = 0.0, double pitch_deg = 0.0,
                                     bool shuffled = false) {
  Random random(static_cast<std::uint64_t>(columns) + rings.size());
  const Eigen::Matrix3d tilt = pitched(pitch_deg, roll_deg).rotation;
  std::vector<Eigen::Vector3f> points;
  for (const double ring : rings) {
    for (int column = 0; column < columns; ++column) {
      const double azimuth = (360.0 * column / columns + 0.05 * ring) * kRadian;
      const double elevation = (ring + random.uniform(-0.01, 0.01)) * kRadian;
      const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      // A tenth returns nothing; above 12 degrees only what stands near does.
      if (random.uniform(0.0, 1.0) < 0.1 || (ring > 12.0 && column % 7 < 4)) continue;
      const double range = std::min(40.0, ring < 0.0 ? 1.8 / std::sin(-elevation) : 25.0);
      points.push_back((range * (tilt * ray)).cast<float>());
    }
  }
  if (shuffled) {
    for (std::size_t i = points.size() - 1; i > 0; --i) {
      std::swap(points[i],
                points[static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(i)))]);
    }
  }
  return points;
}

struct Estimator {
  SamplingEstimator estimator;
  MemoryBlock block = lay_out([this](Arena& arena) { estimator.allocate(arena); });
  SamplingEstimate measure(const std::vector<Eigen::Vector3f>& points) {
    estimator.begin();
    while (estimator.step(view_of(points), 0.5F, 120.0F)) {
    }
    return estimator.estimate();
  }
};

}  // namespace

TEST_CASE("columns from 256 to 2048 and rings from 16 to 128 are measured within 8 %") {
  Estimator with;
  for (const int columns : {256, 512, 1024, 1800, 2048}) {
    for (const int rings : {16, 32, 64, 128}) {
      CAPTURE(columns, rings);
      const double width_deg = rings == 16 ? 30.0 : 22.5;
      const auto found =
          with.measure(scan_of(even_rings(rings, -0.5 * width_deg, 0.5 * width_deg), columns));
      REQUIRE(found.valid);
      CHECK(found.sampling.azimuth_deg == Approx(360.0 / columns).epsilon(0.08));
      CHECK(found.sampling.elevation_deg == Approx(width_deg / (rings - 1)).epsilon(0.08));
    }
  }
}

TEST_CASE("neither the points' order nor a tilt of the sensor's axis in their frame matters") {
  Estimator with;
  for (const int rings : {16, 64, 128}) {
    for (const double pitch_deg : {-15.0, 5.0, 10.0, 15.0}) {
      for (const int columns : {512, 1024}) {
        CAPTURE(rings, pitch_deg, columns);
        const auto found = with.measure(
            scan_of(even_rings(rings, -16.0, 15.0), columns, 0.3 * pitch_deg, pitch_deg, true));
        REQUIRE(found.valid);
        CHECK(found.sampling.azimuth_deg == Approx(360.0 / columns).epsilon(0.1));
        CHECK(found.sampling.elevation_deg == Approx(31.0 / (rings - 1)).epsilon(0.1));
        CHECK(found.elevation_min_deg < -16.0F - 0.8F * static_cast<float>(std::abs(pitch_deg)));
      }
    }
  }
}

TEST_CASE(
    "rays of points that are published twice are measured as those of points published once") {
  Estimator with;
  for (const int rings : {16, 64}) {
    const std::vector<Eigen::Vector3f> once = scan_of(even_rings(rings, -15.0, 15.0), 1024);
    std::vector<Eigen::Vector3f> in_turn;
    for (const Eigen::Vector3f& point : once) in_turn.insert(in_turn.end(), 2, point);
    std::vector<Eigen::Vector3f> behind = once;
    behind.insert(behind.end(), once.begin(), once.end());
    for (const auto& points : {in_turn, behind}) {
      const auto found = with.measure(points);
      REQUIRE(found.valid);
      CHECK(found.sampling.azimuth_deg == Approx(360.0 / 1024).epsilon(0.08));
      CHECK(found.sampling.elevation_deg == Approx(30.0 / (rings - 1)).epsilon(0.08));
    }
  }
}

TEST_CASE("of uneven rings the middle gap is measured") {
  // A third each 0.33, 0.33 and 0.5 degrees apart, as an HDL-64E has them.
  std::vector<double> rings;
  for (int i = 0; i < 32; ++i) rings.push_back(2.0 - 0.33 * i);
  for (int i = 0; i < 32; ++i) rings.push_back(-8.8 - 0.5 * i);
  Estimator with;
  const auto found = with.measure(scan_of(rings, 2000));
  REQUIRE(found.valid);
  CHECK(found.sampling.elevation_deg >= 0.32F);
  CHECK(found.sampling.elevation_deg <= 0.51F);
}

TEST_CASE("what has no rings is not measured") {
  Estimator with;
  Random random(5);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 20000; ++i) {
    const double azimuth = random.uniform(-180.0, 180.0) * kRadian;
    const double sine = random.uniform(-0.3, 0.3);
    const double cosine = std::sqrt(1.0 - sine * sine);
    points.push_back(
        (20.0 * Eigen::Vector3d(cosine * std::cos(azimuth), cosine * std::sin(azimuth), sine))
            .cast<float>());
  }
  CHECK_FALSE(with.measure(points).valid);
  CHECK_FALSE(with.measure({}).valid);
  CHECK_FALSE(with.measure(std::vector<Eigen::Vector3f>(50, {10.0F, 0.0F, 0.0F})).valid);
}

namespace {

/// A scan of the OS2-128 in a mode, in a pitched frame.
std::vector<Eigen::Vector3f> os2_scan(int columns, double pitch_deg = 0.0) {
  return scan_of(even_rings(128, -11.25, 11.25), columns, 0.0, pitch_deg);
}

struct Monitor {
  /// The first scan of a keyframe, all at once; whether it changed the images.
  bool look(const std::vector<Eigen::Vector3f>& points) {
    monitor.begin();
    while (monitor.step(view_of(points))) {
    }
    return monitor.has_changed();
  }
  /// Poses of the keyframe's ten scans, which sways or leans; whether closing changed the images.
  bool close(bool sways) {
    for (int scan = 0; scan < 10; ++scan) {
      monitor.add_pose(pitched(sways ? 5.0 * std::sin(1.2 * scan) : 3.0));
    }
    return monitor.close();
  }
  PipelineConfig config = preset(SensorKind::kOs2_128);
  SamplingMonitor monitor;
  MemoryBlock block = lay_out([this](Arena& arena) { monitor.allocate(arena, config); });
};

}  // namespace

TEST_CASE("a sensor sampled as its data sheet says keeps the preset's images") {
  Monitor with;
  CHECK_FALSE(with.look(os2_scan(1024)));
  CHECK(with.monitor.statistics().ray_spacing_deg == Approx(0.352).epsilon(0.05));
  CHECK_FALSE(with.monitor.statistics().rays_differ);
  CHECK_FALSE(with.monitor.statistics().elevations_differ);
}

TEST_CASE("the images follow another mode at once, and a change of mode once it is seen twice") {
  Monitor with;
  const auto few = os2_scan(512);
  const auto many = os2_scan(1024);
  REQUIRE(with.look(few));
  CHECK(with.monitor.statistics().rays_differ);
  CHECK(with.monitor.free_space().azimuth_resolution_deg ==
        Approx(0.85 * 360.0 / 512).epsilon(0.05));
  CHECK(with.monitor.free_space().full_weight_range_m == Approx(16.3).epsilon(0.05));
  CHECK(with.monitor.free_space().ray_spacing_deg == Approx(360.0 / 512).epsilon(0.05));
  int changed = 0;
  for (int keyframe = 0; keyframe < 10; ++keyframe) {
    changed += with.look(many) ? 1 : 0;
  }
  CHECK(changed == 1);
  CHECK(with.monitor.statistics().changes == 1);
  CHECK_FALSE(with.monitor.statistics().rays_differ);
  CHECK(with.monitor.free_space().image_shape() == with.config.free_space.image_shape());
}

TEST_CASE("images of points in a pitched frame hold all of them, within the room there is") {
  Monitor with;
  const auto points = os2_scan(1024, 15.0);
  REQUIRE(with.look(points));
  with.monitor.add_pose({});
  with.monitor.add_pose({});
  CHECK(with.monitor.close());
  CHECK(with.monitor.statistics().elevations_differ);
  CHECK_FALSE(with.monitor.statistics().rays_differ);
  const ImageProjection projection(with.monitor.free_space().image_shape());
  CHECK(projection.pixels() <= SamplingMonitor::max_pixels(with.config.free_space));
  std::size_t outside = 0;
  for (const Eigen::Vector3f& p : points) {
    std::int32_t pixel = 0;
    float range_m = 0.0F;
    projection.project(&p.x(), &p.y(), &p.z(), 1, &pixel, &range_m);
    outside += pixel == ImageProjection::kOutside ? 1 : 0;
  }
  CHECK(outside < points.size() / 100);
}

TEST_CASE("rays beyond the field of view tell of the sensor unless it turns as much in a sweep") {
  for (const bool sways : {false, true}) {
    CAPTURE(sways);
    Monitor with;
    REQUIRE(with.look(os2_scan(1024, 5.0)));
    CHECK(with.close(sways) == !sways);
    CHECK(with.monitor.statistics().elevations_differ == !sways);
    // Either way the images hold what was seen.
    CHECK(with.monitor.free_space().elevation_max_deg > 15.0F);
    CHECK_FALSE(with.monitor.close());
  }
}

TEST_CASE("a turn in one keyframe excuses no rays beyond the field of view in a later one") {
  Monitor with;
  with.look(os2_scan(1024));
  REQUIRE_FALSE(with.close(true));
  const auto beyond = os2_scan(1024, 5.0);
  for (int keyframe = 0; keyframe < 8; ++keyframe) {  // one of a few is measured
    with.look(beyond);
    with.close(false);
  }
  CHECK(with.monitor.statistics().elevations_differ);
}

TEST_CASE("keyframes carry the measured shape, and their statistics say so") {
  Scene scene;  // 40 rings of 720 columns: no HDL-64E
  scene.boxes = {standing_box({8.0, 0.0, 1.5}, {0.3, 6.0, 1.5})};
  OwnedPipeline pipeline(small_config());
  REQUIRE(pipeline);
  for (int i = 0; i < 10; ++i) {
    const LabelledScan scan = scene.scan(sensor_at(0.1 * i, 0), 0.1 * i);
    REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0.1 * i, 0), 1 + i).error.ok());
  }
  const KeyframeView& view = pipeline->keyframe();
  CHECK(view.statistics->sampling.ray_spacing_deg == Approx(0.5).epsilon(0.1));
  CHECK(view.statistics->sampling.ring_spacing_deg == Approx(32.0 / 39).epsilon(0.1));
  CHECK(view.statistics->sampling.rays_differ);
  CHECK(view.image_shape.azimuth_resolution_deg == Approx(0.85 * 0.5).epsilon(0.1));
  CHECK(view.images.size() == 2);
  CHECK(view.images[0].pixels.size() == ImageProjection(view.image_shape).pixels());
}
