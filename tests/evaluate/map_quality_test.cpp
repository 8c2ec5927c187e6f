// Tests of AC, CD and MME.
#include "src/evaluate/map_quality.hpp"

#include "tests/random.hpp"
#include "tests/test.hpp"

using namespace unimapper::evaluate;
using Cloud = std::vector<Eigen::Vector3f>;

TEST_CASE("accuracy pools the distances of both clouds, the Chamfer distance adds their means") {
  const Cloud first = {{0, 0, 0}, {100, 0, 0}};  // the second is far from everything
  const Cloud second = {{0, 0, 1}, {0, 0, 2}, {0, 0, 3}};
  const CloudAgreement a = compare_clouds(first, second, 5.0);
  CHECK(a.inliers_first == 1);
  CHECK(a.inliers_second == 3);
  CHECK(a.ac_mean_m == Approx((1.0 + 1.0 + 2.0 + 3.0) / 4));
  CHECK(a.ac_rmse_m == Approx(std::sqrt((1.0 + 1.0 + 4.0 + 9.0) / 4)));
  CHECK(a.cd_l2_m == Approx(1.0 + (1.0 + 2.0 + 3.0) / 3));
  CHECK(a.cd_l2_squared_m2 == Approx(1.0 + (1.0 + 4.0 + 9.0) / 3));
  CHECK(compare_clouds(first, first, 5.0).cd_l2_m == 0.0);
}

TEST_CASE("points just nearer than the threshold count, those at it do not") {
  const Cloud first = {{0, 0, 0}, {10, 0, 0}};
  const Cloud second = {{0, 0, 2}, {10, 0, 3}};
  CHECK(compare_clouds(first, second, 2.0).inliers_first == 0);
  CHECK(compare_clouds(first, second, 2.001).inliers_first == 1);
  CHECK(compare_clouds(first, second, 2.001).cd_l2_m == Approx(4.0));
}

TEST_CASE("clouds that do not touch have no agreement") {
  CHECK(std::isnan(compare_clouds(Cloud{{0, 0, 0}}, Cloud{{0, 0, 9}}, 5.0).ac_rmse_m));
  CHECK(std::isnan(compare_clouds({}, Cloud{{0, 0, 9}}, 5.0).cd_l2_m));
  CHECK(std::isnan(compare_clouds({}, {}, 5.0).cd_l2_m));
}

namespace {

/// Entropy of a Gaussian in three dimensions by the determinant of its covariance.
double gaussian_entropy(double determinant) {
  return 0.5 * (3 * std::log(2 * 3.14159265358979 * 2.718281828459045) + std::log(determinant));
}

}  // namespace

TEST_CASE("the entropy of a Gaussian is one half ln |2 pi e Sigma|") {
  // A deterministic normal sample: products of inverse-free sums of twelve uniforms.
  unimapper::test::Random random(7);
  const auto normal = [&random] {
    float sum = -6.0F;
    for (int i = 0; i < 12; ++i) sum += static_cast<float>(random.uniform());
    return sum;
  };
  Cloud cloud;
  for (int i = 0; i < 4000; ++i)
    cloud.push_back({0.3F * normal(), 0.2F * normal(), 0.1F * normal()});
  const MapEntropy entropy = map_entropy(cloud, {.radius_m = 100.0, .max_queries = 3});
  CHECK(entropy.points == 3);
  CHECK(entropy.mean == Approx(gaussian_entropy(std::pow(0.3 * 0.2 * 0.1, 2))).margin(0.05));
}

TEST_CASE("the covariance behind the entropy is that of a sample, divided by one less") {
  // The corners of a cube: the sum of squares is 8 along every axis.
  Cloud corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(
        {i % 2 == 0 ? -1.0F : 1.0F, i / 2 % 2 == 0 ? -1.0F : 1.0F, i / 4 == 0 ? -1.0F : 1.0F});
  }
  const MapEntropy entropy = map_entropy(corners, {.radius_m = 10.0, .min_neighbours = 8});
  CHECK(entropy.points == 8);
  CHECK(entropy.mean == Approx(gaussian_entropy(std::pow(8.0 / 7.0, 3))).margin(1e-6));
  const MapEntropy none = map_entropy(corners, {.radius_m = 10.0, .min_neighbours = 9});
  CHECK(none.points == 0);
  CHECK(none.skipped == 8);
}

TEST_CASE("points with too few neighbours, or flat ones, have no entropy") {
  Cloud cloud = {{0, 0, 0}, {50, 0, 0}};
  CHECK(map_entropy(cloud, {}).skipped == 2);
  CHECK(std::isnan(map_entropy(cloud, {}).mean));
  cloud.clear();
  for (int i = 0; i < 100; ++i) {
    cloud.push_back({0.125F * static_cast<float>(i % 10), 0.125F * static_cast<float>(i / 10), 0});
  }
  CHECK(map_entropy(cloud, {.min_neighbours = 4}).points == 0);
  CHECK(std::isnan(map_entropy({}, {}).mean));
}

TEST_CASE("a part of the points tells what all tell") {
  unimapper::test::Random random(4);
  Cloud first;
  Cloud second;
  for (int i = 0; i < 20'000; ++i) {
    const auto around = [&](float size) {
      const auto one = [&] { return size * (static_cast<float>(random.uniform()) - 0.5F); };
      return Eigen::Vector3f(one(), one(), one());
    };
    const Eigen::Vector3f at = around(10.0F);
    first.push_back(at);
    second.push_back(at + around(0.2F));
  }
  const double taus[] = {5.0, 0.1};
  const auto all = compare_clouds(first, second, taus, 20'000);
  const auto some = compare_clouds(first, second, taus, 5'000);
  CHECK(all[0].ac_rmse_m == compare_clouds(first, second, 5.0).ac_rmse_m);
  CHECK(all[1].ac_rmse_m == compare_clouds(first, second, 0.1).ac_rmse_m);
  CHECK(some[0].inliers_first == 5'000);
  CHECK(some[0].ac_rmse_m == Approx(all[0].ac_rmse_m).epsilon(0.05));
}
