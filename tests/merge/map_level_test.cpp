// Levelling of the map by its keyframes
#include "src/merge/map_level.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <vector>

using namespace unimapper;
using namespace unimapper::merge;

namespace {

constexpr KeyframeUp kSure{true, 1e-5F, 0.0F, 1e-5F};
constexpr KeyframeUp kUnsure{true, 1e-2F, 0.0F, 1e-2F};

}  // namespace

TEST_CASE("a map whose keyframes lean is turned upright") {
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.05, 1.0).normalized();
  const std::vector<UpObservation> observations(5, UpObservation{up, kSure});
  const Eigen::Matrix3d turn = levelling_rotation(observations);
  CHECK((turn * up - Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  // The shortest turn: none about the vertical.
  CHECK((turn * up.cross(Eigen::Vector3d::UnitZ()) - up.cross(Eigen::Vector3d::UnitZ())).norm() <
        1e-12);
}

TEST_CASE("a map of which nobody knows up stays as it is") {
  const std::vector<UpObservation> observations{{{0.1, 0.0, 0.99}, {}}};
  CHECK(levelling_rotation(observations) == Eigen::Matrix3d::Identity());
  CHECK(levelling_rotation({}) == Eigen::Matrix3d::Identity());
}

TEST_CASE("certain keyframes count more than uncertain ones") {
  const Eigen::Vector3d sure = Eigen::Vector3d(0.1, 0.0, 1.0).normalized();
  const Eigen::Vector3d unsure = Eigen::Vector3d(-0.1, 0.0, 1.0).normalized();
  const Eigen::Matrix3d turn =
      levelling_rotation(std::vector<UpObservation>{{sure, kSure}, {unsure, kUnsure}});
  CHECK((turn * sure).head<2>().norm() < 1e-3);
}
