// Tests of poses and levelled frames.
#include "unimapper/core/pose.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

Pose sample_pose() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized())),
          {4.0, -5.0, 6.0}};
}

}  // namespace

TEST_CASE("poses compose as they are applied one after the other, inverses to the identity") {
  const Pose a = sample_pose();
  const Pose identity = a * a.inverse();
  CHECK(identity.rotation.isApprox(Eigen::Matrix3d::Identity(), 1e-12));
  CHECK(identity.translation.norm() < 1e-12);
  const Pose b{Eigen::Quaterniond(0.9, 0.1, -0.2, 0.3), {1.0, 2.0, 3.0}};
  const Eigen::Vector3d p(0.5, -0.25, 8.0);
  CHECK(((a * b) * p - a * (b * p)).norm() < 1e-12);
}

TEST_CASE("only rotations are rigid") {
  CHECK(sample_pose().is_rigid());
  Pose pose = sample_pose();
  pose.rotation *= 1.01;
  CHECK_FALSE(pose.is_rigid());
  pose = sample_pose();
  pose.rotation.col(0) = -pose.rotation.col(0);  // a mirror
  CHECK_FALSE(pose.is_rigid());
  pose = sample_pose();
  pose.translation.x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(pose.is_rigid());
  pose.translation.x() = std::numeric_limits<double>::infinity();
  CHECK_FALSE(pose.is_rigid());
}

TEST_CASE("the angle of a rotation is recovered from zero to half a turn") {
  for (const double angle : {0.0, 1e-6, 0.5, 1.5, 3.0, 3.14159265}) {
    const Eigen::Matrix3d r =
        Eigen::AngleAxisd(angle, Eigen::Vector3d(1, -1, 0.5).normalized()).toRotationMatrix();
    CHECK(rotation_angle(r) == Approx(angle).margin(1e-7));
  }
}

TEST_CASE("a levelled frame keeps position and heading and has gravity along z") {
  Pose sensor;
  sensor.rotation = (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitX()))
                        .toRotationMatrix();
  sensor.translation = {1.0, 2.0, 3.0};
  const Pose level = level_frame(sensor);
  CHECK(level.is_rigid(1e-9));
  CHECK(level.translation == sensor.translation);
  CHECK(level.rotation.col(2) == Eigen::Vector3d::UnitZ());
  CHECK(std::atan2(level.rotation(1, 0), level.rotation(0, 0)) == Approx(0.7));
}

TEST_CASE("a frame levelled by another up has that along z and keeps the heading") {
  Pose sensor;
  sensor.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.2, 1.0).normalized();
  const Pose level = level_frame(sensor, up);
  CHECK(level.is_rigid(1e-9));
  CHECK(level.rotation.col(2) == up);
  // The heading lies in the plane of x and up.
  CHECK(level.rotation.col(1).dot(sensor.rotation.col(0)) == Approx(0.0).margin(1e-12));
  CHECK(level.rotation.col(0).dot(sensor.rotation.col(0)) > 0.9);
  // Turning everything turns the frame along.
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up);
  const Pose turned = level_frame({(turn * sensor.rotation).eval(), sensor.translation}, up);
  CHECK((turned.rotation - turn * level_frame(sensor).rotation).norm() < 1e-12);
}

TEST_CASE("a sensor that looks straight up still has a levelled frame") {
  Pose sensor;
  sensor.rotation =
      Eigen::AngleAxisd(-1.5707963267948966, Eigen::Vector3d::UnitY()).toRotationMatrix();
  CHECK(level_frame(sensor).is_rigid(1e-9));
}
