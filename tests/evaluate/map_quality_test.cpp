// Tests of AC, CD and MME.
#include "unimapper/evaluate/map_quality.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/random.hpp"

using namespace unimapper::evaluate;
using Cloud = std::vector<Eigen::Vector3f>;

TEST_CASE("accuracy and Chamfer distance of two tiny clouds, by hand") {
  const Cloud first = {{0, 0, 0}, {10, 0, 0}, {100, 0, 0}};
  const Cloud second = {{0, 0, 1}, {10, 0, 3}};
  const CloudAgreement a = compare_clouds(first, second, 5.0);
  CHECK(a.inliers_first == 2);  // the third is 90 m from everything
  CHECK(a.inliers_second == 2);
  CHECK(a.ac_mean_m == Approx(2.0));
  CHECK(a.ac_rmse_m == Approx(std::sqrt((1.0 + 9.0) / 2)));
  CHECK(a.cd_l2_m == Approx(4.0));
  CHECK(a.cd_l2_squared_m2 == Approx(10.0));
}

TEST_CASE("the Chamfer distance adds the means of both clouds, each over its own points") {
  const Cloud first = {{0, 0, 0}};
  const Cloud second = {{0, 0, 1}, {0, 0, 2}, {0, 0, 3}};
  const CloudAgreement a = compare_clouds(first, second, 5.0);
  CHECK(a.inliers_first == 1);
  CHECK(a.inliers_second == 3);
  CHECK(a.cd_l2_m == Approx(1.0 + (1.0 + 2.0 + 3.0) / 3));
  CHECK(a.cd_l2_squared_m2 == Approx(1.0 + (1.0 + 4.0 + 9.0) / 3));
}

TEST_CASE("the threshold decides which points count") {
  const Cloud first = {{0, 0, 0}, {10, 0, 0}};
  const Cloud second = {{0, 0, 1}, {10, 0, 3}};
  const CloudAgreement a = compare_clouds(first, second, 2.0);
  CHECK(a.inliers_first == 1);
  CHECK(a.cd_l2_m == Approx(2.0));
}

TEST_CASE("points just nearer than the threshold count, those at it do not") {
  const Cloud first = {{0, 0, 0}};
  const Cloud second = {{0, 0, 2}};
  CHECK(compare_clouds(first, second, 2.0).inliers_first == 0);
  CHECK(compare_clouds(first, second, 2.001).inliers_first == 1);
}

TEST_CASE("clouds that do not touch have no agreement") {
  CHECK(std::isnan(compare_clouds(Cloud{{0, 0, 0}}, Cloud{{0, 0, 9}}, 5.0).ac_rmse_m));
  CHECK(std::isnan(compare_clouds({}, Cloud{{0, 0, 9}}, 5.0).cd_l2_m));
  CHECK(std::isnan(compare_clouds({}, {}, 5.0).cd_l2_m));
}

TEST_CASE("identical clouds agree to zero") {
  const Cloud cloud = {{1, 2, 3}, {4, 5, 6}};
  CHECK(compare_clouds(cloud, cloud, 5.0).cd_l2_m == 0.0);
}

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
  EntropyConfig config;
  config.radius_m = 100.0;
  config.max_queries = 3;
  const MapEntropy entropy = map_entropy(cloud, config);
  const double expected = 0.5 * (3 * std::log(2 * 3.14159265358979 * 2.718281828459045) +
                                 2 * std::log(0.3 * 0.2 * 0.1));
  CHECK(entropy.points == 3);
  CHECK(entropy.mean == Approx(expected).margin(0.05));
}

TEST_CASE("the covariance behind the entropy is that of a sample, divided by one less") {
  // The corners of a cube: the sum of squares is 8 along every axis.
  Cloud corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(
        {i % 2 == 0 ? -1.0F : 1.0F, i / 2 % 2 == 0 ? -1.0F : 1.0F, i / 4 == 0 ? -1.0F : 1.0F});
  }
  EntropyConfig config;
  config.radius_m = 10.0;
  config.min_neighbours = 8;
  const MapEntropy entropy = map_entropy(corners, config);
  const double expected =
      0.5 * (3 * std::log(2 * 3.14159265358979 * 2.718281828459045) + 3 * std::log(8.0 / 7.0));
  CHECK(entropy.points == 8);
  CHECK(entropy.mean == Approx(expected).margin(1e-6));
  config.min_neighbours = 9;
  CHECK(map_entropy(corners, config).points == 0);
  CHECK(map_entropy(corners, config).skipped == 8);
}

TEST_CASE("points with too few neighbours, or flat ones, have no entropy") {
  Cloud cloud = {{0, 0, 0}, {50, 0, 0}};
  CHECK(map_entropy(cloud, {}).skipped == 2);
  CHECK(std::isnan(map_entropy(cloud, {}).mean));
  cloud.clear();
  for (int i = 0; i < 100; ++i) {
    cloud.push_back({0.125F * static_cast<float>(i % 10), 0.125F * static_cast<float>(i / 10), 0});
  }
  EntropyConfig config;
  config.min_neighbours = 4;
  CHECK(map_entropy(cloud, config).points == 0);
  CHECK(std::isnan(map_entropy({}, config).mean));
}

TEST_CASE("a blurred wall has more entropy than a crisp one") {
  const auto wall = [](float thickness) {
    Cloud cloud;
    for (int i = 0; i < 40; ++i) {
      for (int j = 0; j < 40; ++j) {
        const float side = (i * 7 + j * 3) % 5 < 2 ? 1.0F : -1.0F;
        cloud.push_back(
            {0.1F * static_cast<float>(i), side * thickness, 0.1F * static_cast<float>(j)});
      }
    }
    return cloud;
  };
  CHECK(map_entropy(wall(0.01F), {}).mean < map_entropy(wall(0.1F), {}).mean - 1.0);
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
