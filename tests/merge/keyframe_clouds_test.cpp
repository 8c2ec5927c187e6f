// Tests of the registration clouds of keyframes
#include "src/merge/keyframe_clouds.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// Keyframes 10 m apart along x; each saw one spot 2 m above itself and nothing else.
std::vector<SessionData> spots(std::size_t count) {
  std::vector<SessionData> sessions(1);
  for (std::size_t k = 0; k < count; ++k) {
    KeyframeRecord keyframe;
    keyframe.T_odometry_keyframe.translation.x() = 10.0 * static_cast<double>(k);
    keyframe.static_cells.push_back({Eigen::Vector3f(0.0F, 0.0F, 2.0F), 3, 0, 0});
    sessions[0].keyframes.push_back(keyframe);
  }
  return sessions;
}

/// Along x, from the keyframe, in ascending order.
std::vector<float> cloud_of(std::size_t keyframe, const RegistrationConfig& config) {
  const std::vector<SessionData> sessions = spots(9);
  KeyframeClouds clouds(sessions, config, 1);
  clouds.prepare({{0, keyframe}});
  std::vector<float> x_m;
  const auto cloud = clouds.cloud({0, keyframe});
  for (const Eigen::Vector3f& p : cloud->points()) x_m.push_back(p.x());
  std::sort(x_m.begin(), x_m.end());
  return x_m;
}

}  // namespace

TEST_CASE("The neighbours of a keyframe join its cloud, as many as configured", "[clouds]") {
  RegistrationConfig config;
  config.submap_keyframes = 0;
  CHECK(cloud_of(4, config) == std::vector<float>{0.0F});
  config.submap_keyframes = 2;
  CHECK(cloud_of(4, config) == std::vector<float>{-20.0F, -10.0F, 0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(0, config) == std::vector<float>{0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(8, config) == std::vector<float>{-20.0F, -10.0F, 0.0F});
}

TEST_CASE("The first and the last keyframe of a session join the clouds of their neighbours",
          "[clouds]") {
  RegistrationConfig config;
  config.submap_keyframes = 2;
  CHECK(cloud_of(1, config) == std::vector<float>{-10.0F, 0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(7, config) == std::vector<float>{-20.0F, -10.0F, 0.0F, 10.0F});
}

TEST_CASE("Cells beyond the radius are left out of a cloud", "[clouds]") {
  RegistrationConfig config;
  config.submap_keyframes = 4;
  config.submap_radius_m = 30.0F;  // 30.07 m to the spots three keyframes away
  CHECK(cloud_of(4, config).size() == 5);
  config.submap_radius_m = 30.1F;
  CHECK(cloud_of(4, config).size() == 7);
}

TEST_CASE("Neighbours join until the cloud holds enough cells", "[clouds]") {
  RegistrationConfig config;
  config.submap_keyframes = 4;
  config.submap_cells = 4;
  CHECK(cloud_of(4, config).size() == 5);
  config.submap_cells = 3;
  CHECK(cloud_of(4, config).size() == 3);
}
