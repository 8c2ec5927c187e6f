// Distance between the walls of two clouds
#include "unimapper/merge/wall_distance.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

using namespace unimapper::merge;
using Cloud = std::vector<Eigen::Vector3f>;

TEST_CASE("Walls are as far apart as one cloud was moved across them", "[walls]") {
  // Two walls at a right angle, ground below; the wall's points are 10 cm apart.
  const auto room = [](float shift_x, float shift_y) {
    Cloud cloud;
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < 30; ++j) {
        const auto along = 0.1F * static_cast<float>(i);
        const auto up = 0.1F * static_cast<float>(j);
        cloud.push_back({along + shift_x, shift_y, up});
        cloud.push_back({shift_x, along + shift_y, up});
        cloud.push_back({along + 3.0F + shift_x, up + 3.0F + shift_y, 0.0F});
      }
    }
    return cloud;
  };
  const WallDistance same = wall_distance(room(0, 0), room(0, 0));
  CHECK(same.median_m < 1e-6);
  CHECK(same.points > 1000);
  const WallDistance moved = wall_distance(room(0.1F, 0.1F), room(0, 0));
  CHECK(moved.median_m == Approx(0.1).margin(0.01));
  CHECK(moved.p90_m < 0.2);
  // What lies along a wall says nothing across it.
  CHECK(wall_distance(room(0.1F, 0), room(0, 0)).median_m < 0.11);
  CHECK(wall_distance(room(50, 0), room(0, 0)).points == 0);
  CHECK(std::isnan(wall_distance({}, room(0, 0)).median_m));
}
