// Tests of the registration clouds of keyframes
#include "src/merge/keyframe_clouds.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// Keyframes `apart_m` along x from each other; each saw one spot 2 m above itself, of so many
/// cells, and nothing else.
std::vector<SessionData> spots(std::size_t count, double apart_m, std::size_t cells) {
  std::vector<SessionData> sessions(1);
  for (std::size_t k = 0; k < count; ++k) {
    KeyframeRecord keyframe;
    keyframe.T_odometry_keyframe.translation.x() = apart_m * static_cast<double>(k);
    keyframe.static_cells.assign(cells, {Eigen::Vector3f(0.0F, 0.0F, 2.0F), 3, 0, 0});
    sessions[0].keyframes.push_back(keyframe);
  }
  return sessions;
}

/// Along x, from the keyframe, in ascending order.
std::vector<float> cloud_of(std::size_t keyframe, double apart_m = 10.0, std::size_t cells = 1) {
  const std::vector<SessionData> sessions = spots(9, apart_m, cells);
  const RegistrationConfig config;
  KeyframeClouds clouds(sessions, config, 1);
  clouds.prepare({{0, keyframe}});
  std::vector<float> x_m;
  const auto cloud = clouds.cloud({0, keyframe});
  for (const Eigen::Vector3f& p : cloud->points()) x_m.push_back(p.x());
  std::sort(x_m.begin(), x_m.end());
  return x_m;
}

}  // namespace

TEST_CASE("Two neighbours before and after a keyframe join its cloud", "[clouds]") {
  CHECK(cloud_of(4) == std::vector<float>{-20.0F, -10.0F, 0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(0) == std::vector<float>{0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(8) == std::vector<float>{-20.0F, -10.0F, 0.0F});
}

TEST_CASE("The first and the last keyframe of a session join the clouds of their neighbours",
          "[clouds]") {
  CHECK(cloud_of(1) == std::vector<float>{-10.0F, 0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(7) == std::vector<float>{-20.0F, -10.0F, 0.0F, 10.0F});
}

TEST_CASE("Cells beyond the radius are left out of a cloud", "[clouds]") {
  // 49.84 m and 50.04 m to the spots two keyframes away.
  CHECK(cloud_of(4, 24.9).size() == 5);
  CHECK(cloud_of(4, 25.0).size() == 3);
}

TEST_CASE("Neighbours join until the cloud holds enough cells", "[clouds]") {
  // With the nearest two 59997 cells, and 60000.
  CHECK(cloud_of(4, 10.0, 19999).size() == 5);
  CHECK(cloud_of(4, 10.0, 20000).size() == 3);
}
