// Probing of registrations along their weakest axis
#include "src/merge/weak_axis.hpp"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/merge/random.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Random;

namespace {

/// 50 m of a tunnel along x, with niches in its walls or without.
std::vector<Eigen::Vector3f> tunnel(std::uint64_t seed, bool has_niches) {
  Random random(seed);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 12000; ++i) {
    const double x = random.uniform(-25, 25);
    const bool niche = has_niches && (std::fmod(x + 100.0, 17.0) < 3.0);
    const Eigen::Vector3d p =
        i % 3 == 0 ? Eigen::Vector3d(x, random.uniform(-2, 2), 0.0)
                   : Eigen::Vector3d(x, (i % 3 == 1 ? 1.0 : -1.0) * (niche ? 3.5 : 2.0),
                                     random.uniform(0, 3));
    points.emplace_back((p + random.normal3(0.01)).cast<float>());
  }
  // The side walls of the niches.
  for (int i = 0; has_niches && i < 4000; ++i) {
    const double x =
        17.0 * std::floor(random.uniform(-1.0, 2.0)) - 100.0 + 102.0 + (i % 2 == 0 ? 0.0 : 3.0);
    points.emplace_back((Eigen::Vector3d(x, (i % 4 < 2 ? 1.0 : -1.0) * random.uniform(2.0, 3.5),
                                         random.uniform(0, 3)) +
                         random.normal3(0.01))
                            .cast<float>());
  }
  return points;
}

struct Probed {
  RegistrationResult result;
  WeakAxis weak;
};

Probed probe(bool has_niches) {
  const RegistrationConfig config;
  const RegistrationCloud target(tunnel(1, has_niches), {}, config);
  const RegistrationCloud source(tunnel(2, has_niches), {}, config);
  Probed probed;
  probed.result = register_clouds(target, source, Pose{}, config);
  REQUIRE(probed.result.converged);
  probed.weak = probe_weak_axis(target, source, probed.result, config, Eigen::Matrix2d::Zero());
  return probed;
}

}  // namespace

TEST_CASE("Along a smooth tunnel a restarted registration stays where it starts",
          "[registration]") {
  const RegistrationConfig config;
  const Probed smooth = probe(false);
  CHECK(std::abs(smooth.weak.axis.x()) > 0.99);
  CHECK(smooth.weak.slip_m > RegistrationConfig::kProbeSlipM);
  CHECK(smooth.weak.slip_m < RegistrationConfig::kProbeM + 0.5);

  const Matrix6d covariance = weakened(smooth.result.information, smooth.weak.axis).inverse();
  CHECK(std::sqrt(covariance(0, 0)) == Approx(kFreeAxisSigmaM).epsilon(0.05));
  const Eigen::Vector3d across = smooth.weak.axis.cross(Eigen::Vector3d::UnitZ());
  CHECK(std::sqrt(across.dot(covariance.topLeftCorner<3, 3>() * across)) < 0.2);
  CHECK(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues().minCoeff() > 0.0);
  const auto free = free_axis(covariance.inverse());
  REQUIRE(free);
  CHECK(std::abs(free->dot(smooth.weak.axis)) > 0.999);
  CHECK_FALSE(free_axis(smooth.result.information));
}

TEST_CASE("Niches bring a restarted registration back", "[registration]") {
  CHECK(probe(true).weak.slip_m < 0.1);
}
