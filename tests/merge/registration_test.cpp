// Tests of G-ICP registration, and of its weakest axis.
#include "src/merge/registration/registration.hpp"

#include <Eigen/Eigenvalues>

#include "src/merge/parallel.hpp"
#include "src/merge/registration/weak_axis.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/random.hpp"
#include "tests/recordings.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

using Points = std::vector<Eigen::Vector3f>;

/// Points of a scene, and which of them are ground.
struct Sample {
  Points points;
  std::vector<std::uint8_t> ground;
};

/// Two walls that meet, a third farther off, poles and ground, sampled with 2 cm of noise.
Sample sample_corner(Random& random) {
  Sample sample;
  const auto add = [&](double x, double y, double z, bool is_ground) {
    sample.points.emplace_back((Eigen::Vector3d(x, y, z) + random.normal3(0.02)).cast<float>());
    sample.ground.push_back(is_ground ? 1 : 0);
  };
  for (int i = 0; i < 6000; ++i) add(random.uniform(-20, 20), random.uniform(-8, 8), 0.0, true);
  for (int i = 0; i < 4000; ++i) add(random.uniform(-20, 20), 8.0, random.uniform(0, 5), false);
  for (int i = 0; i < 3000; ++i) add(20.0, random.uniform(-8, 8), random.uniform(0, 5), false);
  for (int i = 0; i < 800; ++i) add(-10.0, -6.0, random.uniform(0, 6), false);
  return sample;
}

Points moved(Points points, const Pose& pose) {
  for (auto& p : points) p = (pose * Eigen::Vector3d(p.cast<double>())).cast<float>();
  return points;
}

/// Points of a binary PLY whose vertices are x y z intensity in float32.
Points read_ply(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  std::size_t count = 0;
  while (std::getline(file, line) && line != "end_header") {
    if (line.rfind("element vertex ", 0) == 0) count = std::stoul(line.substr(15));
  }
  Points points(count);
  for (auto& p : points) {
    float values[4];
    file.read(reinterpret_cast<char*>(values), sizeof values);
    p = {values[0], values[1], values[2]};
  }
  return points;
}

double turn(const Pose& a, const Pose& b) {
  return rotation_angle(a.rotation.transpose() * b.rotation);
}

}  // namespace

TEST_CASE("Covariances are the same in any order, by several threads, and for few points",
          "[registration]") {
  Random random(1);
  const Points all = sample_corner(random).points;
  const std::size_t count = GENERATE(std::size_t{4}, std::size_t{2000});
  const Points points(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
  const RegistrationCloud one(points, {}, RegistrationConfig());
  const RegistrationCloud shared(points, {}, RegistrationConfig());
  REQUIRE(one.size() == shared.size());
  constexpr std::size_t kThreads = 3;
  std::vector<std::uint8_t> differs(kThreads, 0);
  std::vector<Eigen::Matrix3f> wanted;
  for (std::size_t i = 0; i < one.size(); ++i) wanted.push_back(one.covariance(i));
  parallel_for(kThreads, kThreads, [&](std::size_t t) {
    for (std::size_t i = one.size(); i-- > 0;) {
      if (shared.covariance(i) != wanted[i]) differs[t] = 1;
    }
  });
  CHECK(differs == std::vector<std::uint8_t>(kThreads, 0));
  for (std::size_t i = 0; i < one.size(); ++i) CHECK(shared.covariance(i) == wanted[i]);
}

TEST_CASE("G-ICP finds back a known motion", "[registration]") {
  Random random(1);
  const auto [points, ground] = sample_corner(random);
  const auto [again, ground_again] = sample_corner(random);
  const RegistrationConfig config;
  for (int trial = 0; trial < 5; ++trial) {
    const Pose truth = random.pose(0.6, 0.05);
    const RegistrationCloud target(points, ground, config);
    const RegistrationCloud source(moved(again, truth.inverse()), ground_again, config);
    const RegistrationResult result = register_clouds(target, source, Pose{}, config);
    CHECK(result.converged);
    CHECK(apart_m(result.T_target_source, truth) < 0.03);
    CHECK(turn(result.T_target_source, truth) < 0.003);
    CHECK(result.rmse_m < 0.1);
    CHECK(result.condition > 0.1);
    CHECK(structure_overlap(target, source, result.T_target_source, 30.0, 0.5) > 0.95);
  }
}

namespace {

constexpr double kFloorM = 0.08;
constexpr double kFloorRad = 0.006;

/// What the information would be if a loop could be known better than the floors.
Matrix6d without_floors(const Matrix6d& information) {
  Matrix6d covariance = information.inverse();
  covariance.diagonal().head<3>().array() -= kFloorM * kFloorM;
  covariance.diagonal().tail<3>().array() -= kFloorRad * kFloorRad;
  return covariance.inverse();
}

}  // namespace

TEST_CASE("Information turns with the source's frame", "[registration]") {
  Random random(3);
  const auto [points, ground] = sample_corner(random);
  RegistrationConfig config;
  config.max_source_points = 1000000;
  const RegistrationCloud cloud(points, ground, config);
  // x becomes y, y becomes z, z becomes x: the turned points share the same leaves.
  Pose turn_of_frame;
  turn_of_frame.rotation << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  const RegistrationCloud turned(moved(points, turn_of_frame.inverse()), ground, config);
  REQUIRE(turned.size() == cloud.size());
  const Matrix6d plain = without_floors(register_clouds(cloud, cloud, Pose{}, config).information);
  const RegistrationResult result = register_clouds(cloud, turned, turn_of_frame, config);
  REQUIRE(result.converged);
  const Matrix6d found = without_floors(result.information);

  const auto in_frame = [&](const Eigen::Matrix3d& r) {
    Matrix6d carry = Matrix6d::Identity();
    carry.bottomRightCorner<3, 3>() = r;
    return Matrix6d(carry.transpose() * plain * carry);
  };
  CHECK((found - in_frame(turn_of_frame.rotation)).norm() < 0.01 * plain.norm());
  CHECK((found - in_frame(turn_of_frame.rotation.transpose())).norm() > 0.3 * plain.norm());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(result.information);
  CHECK(solver.eigenvalues().minCoeff() > 0.0);
}

TEST_CASE("Information is never better than 8 cm and 6 mrad", "[registration]") {
  Random random(3);
  const auto [points, ground] = sample_corner(random);
  const RegistrationConfig config;
  const RegistrationCloud cloud(points, ground, config);
  const Matrix6d covariance = register_clouds(cloud, cloud, Pose{}, config).information.inverse();
  for (int axis = 0; axis < 6; ++axis) {
    const double floor = axis < 3 ? kFloorM : kFloorRad;
    CHECK(covariance(axis, axis) > 0.99 * floor * floor);
    CHECK(covariance(axis, axis) < 1.5 * floor * floor);
  }
}

TEST_CASE("Overlap counts only what both keyframes have within reach", "[registration]") {
  // Two keyframes 20 m apart along a wall, each with all of it within 30 m.
  Points there;
  Points here;
  for (float x = -29.9F; x < 50.0F; x += 0.3F) {
    for (float z = 0.0F; z < 3.0F; z += 0.3F) {
      const Eigen::Vector3f p(x, 2.0F, z);
      const Eigen::Vector3f q = p - Eigen::Vector3f(20.0F, 0.0F, 0.0F);
      if (p.norm() < 30.0F) there.push_back(p);
      if (q.norm() < 30.0F) here.push_back(q);
    }
  }
  const RegistrationConfig config;
  const RegistrationCloud target(there, {}, config);
  const RegistrationCloud source(here, {}, config);
  const Pose T_target_source = shifted(20.0);
  CHECK(structure_overlap(target, source, T_target_source, 30.0, 0.5) > 0.98);
  // Two thirds of either cloud's points lie within the other's reach.
  CHECK(structure_overlap(target, source, T_target_source, 80.0, 0.5) ==
        Approx(2.0 / 3.0).margin(0.05));
}

TEST_CASE("Clouds too poor to align do not converge", "[registration]") {
  const RegistrationConfig config;
  const Points none;
  const Points few{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Points bad{{nan, 0, 0}, {0, nan, 1e30F}, {1e30F, 0, 0}};
  for (const auto* points : {&none, &few, &bad}) {
    const RegistrationCloud a(*points, {}, config);
    const RegistrationCloud b(*points, {}, config);
    CHECK_FALSE(register_clouds(a, b, Pose{}, config).converged);
    CHECK(structure_overlap(a, b, Pose{}, 30.0, 0.5) == 0.0);
  }
  CHECK(RegistrationCloud(bad, {}, config).size() == 0);
}

TEST_CASE("G-ICP aligns a real outdoor pair as well as its peers", "[registration][real]") {
  const auto folder = unimapper::testing::find_recording("registration_pair");
  if (folder.empty()) return;
  Pose truth;
  std::ifstream file(folder / "small_gicp_T_target_source.txt");
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) file >> truth.rotation(row, column);
    file >> truth.translation[row];
  }
  RegistrationConfig config;
  config.leaf_m = 0.25F;
  const RegistrationCloud target(read_ply(folder / "small_gicp_target.ply"), {}, config);
  const RegistrationCloud source(read_ply(folder / "small_gicp_source.ply"), {}, config);
  REQUIRE(target.size() > 3000);
  const RegistrationResult result = register_clouds(target, source, Pose{}, config);
  CHECK(result.converged);
  CHECK(apart_m(result.T_target_source, truth) < 0.02);
  CHECK(turn(result.T_target_source, truth) < 0.7 * 3.14159265 / 180.0);
  INFO("points " << target.size() << ", iterations " << result.iterations);
}

TEST_CASE("Objects moved between two visits hardly affect the registration", "[registration]") {
  Random random(5);
  auto [points, ground] = sample_corner(random);
  auto [again, ground_again] = sample_corner(random);
  // Parked cars that all stand 60 cm farther along x on the second visit.
  for (int car = 0; car < 6; ++car) {
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3f side(static_cast<float>(-14.0 + 5.0 * car),
                                 static_cast<float>(random.uniform(-4.0, -2.0)),
                                 static_cast<float>(random.uniform(0.2, 1.6)));
      points.push_back(side);
      ground.push_back(0);
      again.emplace_back(side + Eigen::Vector3f(0.6F, 0.0F, 0.0F));
      ground_again.push_back(0);
    }
  }
  const RegistrationConfig config;
  const RegistrationCloud target(points, ground, config);
  const RegistrationCloud source(again, ground_again, config);
  const RegistrationResult result = register_clouds(target, source, Pose{}, config);
  CHECK(result.converged);
  CHECK(std::abs(result.T_target_source.translation.x()) < 0.03);
}

TEST_CASE("what is known of the tilt decides where the surfaces do not", "[registration]") {
  // One facade: any turn about its normal fits nearly as well.
  Random random(17);
  const auto facade = [&](double reach) {
    Points points;
    for (int i = 0; i < 9000; ++i) {
      const Eigen::Vector3d p(10.0, random.uniform(-reach, reach), random.uniform(-reach, reach));
      points.emplace_back((p + random.normal3(0.02)).cast<float>());
    }
    return points;
  };
  const RegistrationConfig config;
  const RegistrationCloud target(facade(16.0), {}, config);
  const RegistrationCloud source(facade(12.0), {}, config);
  const Pose leaning = turned_about(Eigen::Vector3d::UnitX(), 0.03);
  const auto aligned = [&](double sigma_rad) {
    const Eigen::Matrix2d information =
        sigma_rad > 0.0 ? Eigen::Matrix2d(Eigen::Matrix2d::Identity() / (sigma_rad * sigma_rad))
                        : Eigen::Matrix2d(Eigen::Matrix2d::Zero());
    return register_clouds(target, source, leaning, config, information);
  };
  const RegistrationResult free = aligned(0.0);
  const RegistrationResult held = aligned(0.003);
  REQUIRE(free.T_target_source.rotation(2, 1) > 0.01);
  CHECK(std::abs(held.T_target_source.rotation(2, 1)) <
        0.5 * std::abs(free.T_target_source.rotation(2, 1)));
  // Its information is that of the prior and the floor, the others' are the points'.
  CHECK(held.information(3, 3) > free.information(3, 3));
  CHECK(held.rmse_m == Approx(free.rmse_m).epsilon(0.2));
}

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

TEST_CASE("Along a smooth tunnel information is weak and a restarted registration stays",
          "[registration]") {
  const RegistrationConfig config;
  const Probed smooth = probe(false);
  const Matrix6d known = smooth.result.information.inverse();
  CHECK(std::sqrt(known(0, 0)) > 2.0 * std::sqrt(known(1, 1)));
  CHECK(smooth.result.condition < 0.02);
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
