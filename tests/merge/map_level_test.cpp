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

TEST_CASE("a direction is turned to z the shortest way, one that points down by half a turn") {
  const Eigen::Matrix3d quarter = rotation_to_z(Eigen::Vector3d(2.0, 0.0, 0.0));
  CHECK((quarter * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  CHECK((quarter * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitY()).norm() < 1e-12);
  for (const double lean : {0.0, 1e-9, 1e-7, 2e-6, 1e-3}) {
    const Eigen::Vector3d down(lean, 0.0, -1.0);
    const Eigen::Matrix3d half = rotation_to_z(down);
    CHECK((half * down.normalized() - Eigen::Vector3d::UnitZ()).norm() < 1e-6);
    CHECK((half * half.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6);
    CHECK(half.determinant() > 0.0);
  }
}
