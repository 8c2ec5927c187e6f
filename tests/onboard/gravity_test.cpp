// Gravity estimator: up from walls, ground and the odometry's promise
#include "src/onboard/attitude/gravity.hpp"

#include "tests/test.hpp"
#include "unimapper/core/pose.hpp"

using namespace unimapper;
using namespace unimapper::onboard;

namespace {

constexpr double rad(double degrees) { return degrees / kDegreesPerRadian; }

/// A scene that stands upright in an odometry frame tilted by `roll_deg`, then `pitch_deg`.
class TiltedScene {
 public:
  explicit TiltedScene(double roll_deg = 0.0, double pitch_deg = 0.0, unsigned seed = 1)
      : T_((Eigen::AngleAxisd(rad(pitch_deg), Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(rad(roll_deg), Eigen::Vector3d::UnitX()))
               .toRotationMatrix()),
        random_(seed) {}

  /// A facade that faces `heading_deg`: `count` voxels in patches of eight. Normals scatter by
  /// `noise_deg`, facades lean by 0.1 degrees (standard deviation).
  void add_facade(double heading_deg, int count, double noise_deg = 0.7) {
    const double lean = gauss(rad(0.1));
    for (int i = 0; i < count; ++i) {
      if (i % 8 == 0) ++patch_;
      add_wall(rad(heading_deg) + gauss(rad(noise_deg)), lean + gauss(rad(noise_deg)));
    }
  }
  /// Planes in any direction, as plants give.
  void add_plants(int count) {
    for (int i = 0; i < count; ++i) {
      if (i % 4 == 0) ++patch_;
      Eigen::Vector3d normal(gauss(1.0), gauss(1.0), gauss(1.0));
      if (std::abs(normal.normalized().z()) > 0.7) normal.z() = 0.0;
      normal.normalize();
      walls.push_back({(T_ * normal).cast<float>(), 0.001F, patch_});
    }
  }
  void add_ground(double slope_deg = 0.0) {
    ground +=
        100.0 * (T_ * Eigen::Vector3d(std::sin(rad(slope_deg)), 0.0, std::cos(rad(slope_deg))));
  }
  /// Facades on both sides of a street and across its ends.
  void add_street(int count) {
    for (const double heading : {0.0, 90.0, 180.0, 270.0, 20.0, 110.0}) {
      add_facade(heading, count / 6);
    }
    add_ground();
  }

  [[nodiscard]] GravityScene view() const { return {walls, ground}; }
  [[nodiscard]] Eigen::Vector3d up() const { return T_.col(2); }

  std::vector<WallPlane> walls;
  Eigen::Vector3d ground = Eigen::Vector3d::Zero();

 private:
  double gauss(double sigma) { return std::normal_distribution<double>(0.0, sigma)(random_); }
  void add_wall(double heading, double rise) {
    const Eigen::Vector3d normal(std::cos(heading) * std::cos(rise),
                                 std::sin(heading) * std::cos(rise), std::sin(rise));
    walls.push_back({(T_ * normal).cast<float>(), 1e-4F, patch_});
  }

  Eigen::Matrix3d T_;
  std::mt19937 random_;
  std::uint32_t patch_ = 0;
};

double error_deg(const UpEstimate& estimate, const TiltedScene& scene) {
  return std::asin(estimate.up.cross(scene.up()).norm()) * kDegreesPerRadian;
}

/// Standard deviation of up along a direction, degrees.
double sigma_deg(const UpEstimate& estimate, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.normalized();
  return std::sqrt(d.dot(estimate.covariance * d)) * kDegreesPerRadian;
}

GravityEstimator estimator(float up_sigma_deg = 0.0F) {
  return GravityEstimator(OdometryConfig{up_sigma_deg});
}

/// After one keyframe of the scene.
UpEstimate estimate(const TiltedScene& scene, float up_sigma_deg = 0.0F) {
  return estimator(up_sigma_deg).add(scene.view());
}

TiltedScene street(double roll_deg, double pitch_deg, int walls, unsigned seed = 1) {
  TiltedScene scene(roll_deg, pitch_deg, seed);
  scene.add_street(walls);
  return scene;
}

}  // namespace

TEST_CASE("up comes from walls, however the odometry's frame is tilted") {
  for (const double tilt_deg : {0.0, 2.0, 5.0, 10.0, 15.0}) {
    for (const double share : {-1.0, 0.0, 0.7, 1.0}) {
      TiltedScene scene = street(tilt_deg * share, tilt_deg * std::sqrt(1.0 - share * share), 480);
      scene.add_plants(100);
      const UpEstimate up = estimate(scene);
      INFO("tilt " << tilt_deg << ", share " << share);
      CHECK(up.known);
      CHECK_FALSE(up.contradicted);
      CHECK(error_deg(up, scene) < 0.3);
      CHECK(up.up.norm() == Approx(1.0));
    }
  }
}

TEST_CASE("the error stays within the covariance") {
  int within = 0;
  int known = 0;
  constexpr int kTrials = 200;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    TiltedScene scene(4.0, -3.0, seed);
    scene.add_facade(10.0, 48, 1.0);
    scene.add_facade(70.0, 48, 1.0);
    scene.add_facade(280.0, 32, 1.0);
    scene.add_plants(60);
    scene.add_ground();
    const UpEstimate up = estimate(scene);
    if (!up.known) continue;
    ++known;
    const Eigen::Vector3d error = up.up - scene.up();
    const Eigen::Matrix3d along = up.up * up.up.transpose();
    // The covariance has no variance along up; one is added so that it can be inverted.
    const double chi_squared = error.dot((up.covariance + along).inverse() * error);
    within += chi_squared < 6.18 ? 1 : 0;
  }
  CHECK(known > kTrials / 2);
  CHECK(within >= known * 95 / 100);
}

TEST_CASE("the covariance grows as walls become fewer") {
  const auto sigma = [](int walls) {
    const UpEstimate up = estimate(street(3.0, 2.0, walls));
    return up.known ? std::sqrt(up.covariance.trace()) * kDegreesPerRadian : 10.0;
  };
  CHECK(sigma(600) < 0.3);
  CHECK(sigma(12) > 1.3 * sigma(600));
}

TEST_CASE("neither walls of one direction nor ground tell up, on however many keyframes") {
  const bool has_walls = GENERATE(false, true);
  TiltedScene scene(has_walls ? 5.0 : 0.0, 0.0);
  if (has_walls) {
    scene.add_facade(0.0, 200);
    scene.add_facade(180.0, 200);
  }
  scene.add_ground(2.5);
  GravityEstimator gravity = estimator();
  for (int keyframe = 0; keyframe < (has_walls ? 200 : 1000); ++keyframe) {
    CHECK_FALSE(gravity.add(scene.view()).known);
  }
  CHECK(gravity.estimate().up == Eigen::Vector3d::UnitZ());
}

TEST_CASE("walls of one direction and a promise: the promise holds along the walls") {
  TiltedScene scene;
  scene.add_facade(0.0, 200);
  scene.add_facade(180.0, 200);
  const UpEstimate up = estimate(scene, 0.5F);
  REQUIRE(up.known);
  CHECK(sigma_deg(up, Eigen::Vector3d::UnitX()) < 0.3);
  CHECK(sigma_deg(up, Eigen::Vector3d::UnitY()) > 0.45);
}

TEST_CASE("slopes do not tilt up where there are walls") {
  TiltedScene scene = street(2.0, 1.0, 300);
  scene.ground.setZero();
  scene.add_ground(8.0);
  CHECK(error_deg(estimate(scene), scene) < 0.3);
}

TEST_CASE("plants alone leave up unknown") {
  int known = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    TiltedScene scene(0.0, 0.0, seed);
    scene.add_plants(300);
    scene.add_ground();
    known += estimate(scene).known ? 1 : 0;
  }
  CHECK(known <= 10);
}

TEST_CASE("without anything to see up is unknown, or what the odometry promises") {
  GravityEstimator gravity = estimator();
  CHECK_FALSE(gravity.estimate().known);
  CHECK_FALSE(gravity.add({}).known);
  CHECK(gravity.estimate().up == Eigen::Vector3d::UnitZ());
  for (const float sigma : {0.3F, 3.0F}) {
    GravityEstimator promised = estimator(sigma);
    CHECK(promised.estimate().known);
    const UpEstimate& up = promised.add({});
    CHECK(up.known);
    CHECK(up.up == Eigen::Vector3d::UnitZ());
    // A weak promise is kept as it was given.
    CHECK(sigma_deg(up, Eigen::Vector3d::UnitX()) ==
          Approx(sigma).epsilon(sigma < 1.0F ? 0.01 : 0.05));
  }
}

TEST_CASE("normals that are none are ignored") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  TiltedScene scene = street(5.0, 3.0, 300);
  const UpEstimate expected = estimate(scene);
  for (const float x : {kNan, kInfinity, 0.0F, 1e30F}) {
    scene.walls.push_back({{x, 0.0F, 0.0F}, 0.0F, 0});
  }
  scene.walls.push_back({{1.0F, 0.0F, 0.0F}, kNan, 0});
  scene.walls.push_back({{1.0F, 0.0F, 0.0F}, -1.0F, 0});
  CHECK(estimate(scene).up == expected.up);

  for (const double z : {-1.0, static_cast<double>(kNan), static_cast<double>(kInfinity)}) {
    scene.ground = {0.0, 0.0, z};
    CHECK(error_deg(estimate(scene), scene) < 0.3);
  }
}

TEST_CASE("keyframes of a session make up more certain, and a restart forgets them") {
  GravityEstimator gravity = estimator();
  const double before = gravity.add(street(6.0, 4.0, 60, 7).view()).covariance.trace();
  for (unsigned seed = 8; seed < 20; ++seed) gravity.add(street(6.0, 4.0, 60, seed).view());
  CHECK(gravity.estimate().covariance.trace() < before);
  CHECK(gravity.add({}).known);  // a keyframe without walls

  gravity.forget();
  CHECK_FALSE(gravity.estimate().known);
  const TiltedScene other = street(-6.0, 0.0, 300, 30);
  CHECK(error_deg(gravity.add(other.view()), other) < 0.3);
}

TEST_CASE("without walls up becomes less certain from keyframe to keyframe, and unknown at last") {
  GravityEstimator gravity = estimator();
  double last = gravity.add(street(6.0, 4.0, 300).view()).covariance.trace();
  int keyframes = 0;
  while (gravity.add({}).known && keyframes < 1000) {
    CHECK(gravity.estimate().covariance.trace() > last);
    last = gravity.estimate().covariance.trace();
    ++keyframes;
  }
  CHECK(keyframes > 20);
  CHECK(keyframes < 1000);
}

TEST_CASE("a promise that the walls contradict is reported and left aside") {
  const TiltedScene scene = street(5.0, 0.0, 300);
  const UpEstimate up = estimate(scene, 0.5F);
  CHECK(up.known);
  CHECK(up.contradicted);
  CHECK(error_deg(up, scene) < 0.3);
  CHECK_FALSE(estimate(street(0.4, 0.0, 300), 0.5F).contradicted);
}

TEST_CASE("a promise draws up towards the odometry's z axis, the more the less walls say") {
  const auto share = [](int walls) {
    const TiltedScene scene = street(0.5, -0.4, walls);
    const UpEstimate alone = estimate(scene);
    const UpEstimate drawn = estimate(scene, 0.5F);
    REQUIRE(alone.known);
    REQUIRE_FALSE(drawn.contradicted);
    // In the direction of what is measured, and not beyond.
    CHECK(drawn.up.head<2>().normalized().dot(alone.up.head<2>().normalized()) > 0.9);
    return drawn.up.head<2>().norm() / alone.up.head<2>().norm();
  };
  const double many = share(600);
  const double few = share(60);
  CHECK(many < 1.0);
  CHECK(many > 0.7);
  CHECK(few < many);
}

TEST_CASE("the sign of a normal does not matter") {
  TiltedScene scene = street(5.0, 3.0, 300);
  const UpEstimate one = estimate(scene);
  for (std::size_t i = 0; i < scene.walls.size(); i += 2) scene.walls[i].normal *= -1.0F;
  const UpEstimate other = estimate(scene);
  CHECK((one.up - other.up).norm() < 1e-12);
  CHECK((one.covariance - other.covariance).norm() < 1e-12);
}
