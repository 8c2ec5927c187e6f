// Tests of the extrinsic calibration given as an argument.
#include "src/input/extrinsic.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace unimapper;
using namespace unimapper::input;

TEST_CASE("an extrinsic turns about the fixed axes x, y, z in this order") {
  const Pose T_base_lidar = parse_extrinsic("1,-2.5,3e-1,90,0,90", "--extrinsic");
  CHECK((T_base_lidar.translation - Eigen::Vector3d(1.0, -2.5, 0.3)).norm() < 1e-12);
  // y goes to z by the roll and stays there; x goes to y by the yaw.
  CHECK((T_base_lidar.rotation * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm() <
        1e-12);
  CHECK((T_base_lidar.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm() <
        1e-12);
  // Down positive.
  const Pose pitched = parse_extrinsic("0,0,0,0,90,0", "--extrinsic");
  CHECK((pitched.rotation * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitZ()).norm() < 1e-12);
}

TEST_CASE("an extrinsic that is not six numbers is refused with its form") {
  for (const char* text : {"", "1,2,3", "1,2,3,4,5,6,7", "1,2,3,4,5,", "1 2 3 4 5 6", "a,2,3,4,5,6",
                           "1,2,3,4,5,nan", "1,2,3,4,5,6 "}) {
    INFO(text);
    CHECK_THROWS_WITH(parse_extrinsic(text, "--extrinsic"),
                      Catch::Contains("--extrinsic: '") && Catch::Contains("x,y,z,roll,pitch,yaw"));
  }
}
