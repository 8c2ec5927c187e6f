// Attitude noise between scans, measured and taken out
#include "src/onboard/attitude/ground_aligner.hpp"

#include "run.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

namespace {

constexpr double kRadian = 3.14159265358979 / 180.0;

struct Aligner {
  GroundAligner aligner;
  MemoryBlock block = lay_out([this](Arena& arena) { aligner.allocate(arena, small_config()); });
};

Scene street() {
  Scene scene;
  scene.boxes = {standing_box({20.0, 9.0, 3.0}, {40.0, 0.5, 3.0}),
                 standing_box({12.0, -4.0, 0.8}, {2.0, 0.9, 0.8}),
                 moving_box({6.0, 2.0, 0.8}, {6.0, 0.0, 0.0}, {2.0, 0.9, 0.8})};
  return scene;
}

Pose tilted(const Pose& pose, double roll_deg, double pitch_deg) {
  const Eigen::Quaterniond tilt = Eigen::AngleAxisd(roll_deg * kRadian, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(pitch_deg * kRadian, Eigen::Vector3d::UnitY());
  return pose * Pose(tilt, Eigen::Vector3d::Zero());
}

/// Roughly normal, of standard deviation 1.
double noise(Random& random) {
  double sum = 0.0;
  for (int i = 0; i < 12; ++i) sum += random.uniform();
  return sum - 6.0;
}

double tilt_deg(const Pose& a, const Pose& b) {
  const double cosine = a.rotation.col(2).dot(b.rotation.col(2));
  return std::acos(std::min(cosine, 1.0)) / kRadian;
}

}  // namespace

TEST_CASE("noise of roll and pitch is measured and taken out of the poses") {
  for (const double sigma_deg : {0.3, 0.5, 1.0}) {
    CAPTURE(sigma_deg);
    Aligner with;
    const Scene scene = street();
    Random random(3);
    double before = 0.0;
    double after = 0.0;
    Pose first_used;
    for (int i = 0; i < 30; ++i) {
      const Pose pose = sensor_at(1.0 * i, 0.0);
      const LabelledScan scan = scene.scan(pose, 0.1 * i);
      const double roll = i == 0 ? 0.0 : sigma_deg * noise(random);
      const double pitch = i == 0 ? 0.0 : sigma_deg * noise(random);
      const Pose given = tilted(pose, roll, pitch);
      const Pose used = with.aligner.align(scan.view(), given);
      CHECK(with.aligner.used_pose(given).rotation == used.rotation);
      if (i < 5) continue;
      CHECK(with.aligner.aligned());
      before += tilt_deg(given, pose);
      after += tilt_deg(used, pose);
    }
    CHECK(after < 0.3 * before);
    CHECK(with.aligner.noise_deg() == Approx(sigma_deg).epsilon(0.35));
  }
}

TEST_CASE("noise is measured, and none invented, where odometry starts at identity on a tilt") {
  const Scene scene = street();
  for (const double sigma_deg : {0.0, 0.5}) {
    CAPTURE(sigma_deg);
    Aligner with;
    Random random(7);
    int aligned = 0;
    for (int i = 0; i < 30; ++i) {
      const Pose pose = sensor_at(1.0 * i, 0.0);
      const LabelledScan scan = scene.scan(pose, 0.1 * i);
      const Pose noisy = tilted(pose, sigma_deg * noise(random), sigma_deg * noise(random));
      (void)with.aligner.align(scan.view(), tilted(Pose{}, 4.0, 13.0) * noisy);
      aligned += with.aligner.aligned() ? 1 : 0;
    }
    CHECK((sigma_deg == 0.0 ? aligned == 0 : aligned > 20));
    CHECK(with.aligner.noise_deg() == Approx(sigma_deg).epsilon(0.4).margin(0.1));
  }
}

TEST_CASE("ground stays known where a coordinate of the odometry changes its sign") {
  Aligner with;
  const Scene scene = street();
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const Pose pose = sensor_at(0.2 * i - 2.0, i % 2 == 0 ? 0.2 : -0.2);
    const LabelledScan scan = scene.scan(pose, 0.1 * i);
    const Pose given = tilted(pose, 0.5 * noise(random), 0.5 * noise(random));
    (void)with.aligner.align(scan.view(), given);
    if (i >= 5) CHECK(with.aligner.aligned());
  }
}

namespace {

/// Points of a strip of ground ahead whose patches of 4 m lie `rough_m` too high or too low, anew
/// in each scan: what a pattern that does not repeat sees of a verge.
std::vector<Eigen::Vector3f> rough_strip(Random& random, double rough_m) {
  double step_m[9][4];
  for (auto& row : step_m) {
    for (double& patch : row) patch = rough_m * noise(random);
  }
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 600; ++i) {
    const double x = random.uniform(4.0, 36.0);
    const double y = random.uniform(-8.0, 8.0);
    const auto row = static_cast<std::size_t>(x / 4.0);
    const auto patch = static_cast<std::size_t>((y + 8.0) / 4.0);
    points.emplace_back(static_cast<float>(x), static_cast<float>(y),
                        static_cast<float>(-1.8 + step_m[row][patch]));
  }
  return points;
}

}  // namespace

TEST_CASE("what the ground's roughness explains is no attitude noise") {
  for (const std::uint64_t seed : {4U, 6U}) {
    CAPTURE(seed);
    Random random(seed);
    Aligner with;
    for (int i = 0; i < 60; ++i) {
      const auto points = rough_strip(random, 0.08);
      (void)with.aligner.align(view_of(points), {});
      CHECK_FALSE(with.aligner.aligned());
    }
    CHECK(with.aligner.noise_deg() == 0.0F);
  }
}

TEST_CASE("sweeps that are not compensated are told from attitude noise") {
  double swing_deg = 3.0;
  const auto pitch_deg = [&](double t) {
    return swing_deg * std::sin(2.0 * 3.14159265358979 * 1.3 * t);
  };
  const Scene scene = street();
  // How long after its pose the middle of a scan was seen, and noise of the poses.
  Aligner with;
  const auto run = [&](double late_s, double sigma_deg) {
    Random random(8);
    for (int i = 0; i < 40; ++i) {
      const double t = 0.1 * i;
      const Pose seen = tilted(sensor_at(0.1 * i, 0.0), 0.0, pitch_deg(t + late_s));
      const LabelledScan scan = scene.scan(seen, t);
      const double roll = sigma_deg * noise(random);
      const double pitch = sigma_deg * noise(random);
      const Pose given = tilted(sensor_at(0.1 * i, 0.0), roll, pitch_deg(t) + pitch);
      (void)with.aligner.align(scan.view(), given);
    }
  };
  SECTION("half a sweep late") {
    run(0.05, 0.0);
    CHECK(with.aligner.sweep_tilt_deg() > 0.3F);
    CHECK(with.aligner.noise_deg() == 0.0F);
    CHECK(with.aligner.aligned());
    with.aligner.forget();
    CHECK(with.aligner.sweep_tilt_deg() == 0.0F);
  }
  SECTION("half a sweep early") {
    run(-0.05, 0.0);
    CHECK(with.aligner.sweep_tilt_deg() > 0.3F);
  }
  SECTION("by less than 0.05 degrees, which is chance") {
    swing_deg = 0.1;
    run(0.05, 0.0);
    CHECK(with.aligner.sweep_tilt_deg() == 0.0F);
  }
  SECTION("compensated") {
    run(0.0, 0.0);
    CHECK(with.aligner.sweep_tilt_deg() == 0.0F);
    CHECK(with.aligner.noise_deg() < 0.1F);
    CHECK_FALSE(with.aligner.aligned());
  }
  SECTION("compensated, and noise of the poses") {
    run(0.0, 0.5);
    CHECK(with.aligner.sweep_tilt_deg() == 0.0F);
    CHECK(with.aligner.noise_deg() == Approx(0.5).epsilon(0.4));
  }
}

TEST_CASE("poses without noise are handed on to the bit, uphill too") {
  Aligner with;
  const Scene scene = street();
  for (int i = 0; i < 20; ++i) {
    const Pose pose = sensor_at(1.0 * i, 0.0);
    const LabelledScan scan = scene.scan(pose, 0.1 * i);
    // The odometry's world is tilted by 4 degrees: a hill.
    const Pose hill = tilted(Pose{}, 0.0, 4.0) * pose;
    const Pose used = with.aligner.align(scan.view(), hill);
    CHECK(used.rotation == hill.rotation);
    CHECK(used.translation == hill.translation);
    CHECK_FALSE(with.aligner.aligned());
  }
  CHECK(with.aligner.noise_deg() < 0.1F);
}

TEST_CASE("with half a degree of noise from scan to scan what stands still stays") {
  const Scene scene = street();
  const auto static_percent = [&](float align_noise_deg) {
    PipelineConfig config = small_config();
    config.ground.align_noise_deg = align_noise_deg;
    OwnedPipeline pipeline(config);
    Random random(9);
    Score score;
    std::vector<LabelledScan> scans;
    for (int i = 0; i < 40; ++i) {
      const Pose pose = sensor_at(0.5 * i, 0.0);
      scans.push_back(scene.scan(pose, 0.1 * i));
      const Pose noisy = tilted(pose, 0.5 * noise(random), 0.5 * noise(random));
      const ScanResult result = pipeline->add_scan(scans.back().view(), noisy, 1 + i);
      REQUIRE(result.error.ok());
      if (!result.keyframe_ready) continue;
      for (std::size_t s = 0; s < pipeline->keyframe().scans.size(); ++s) {
        const LabelledScan& scan = scans[pipeline->keyframe().scans[s].scan_index];
        std::vector<PointLabel> labels(scan.points.size());
        (void)pipeline->labels(s, labels);
        score.add(scan, labels);
      }
    }
    if (align_noise_deg > 0.0F) {
      CHECK(pipeline->keyframe().statistics->attitude_noise_deg > 0.3F);
      CHECK(pipeline->keyframe().statistics->aligned_scans == 10);
    }
    return score.static_percent();
  };
  const double with = static_percent(0.15F);
  const double without = static_percent(0.0F);
  CAPTURE(with, without);
  CHECK(with > 99.0);
  CHECK(with > without + 0.5);
}
