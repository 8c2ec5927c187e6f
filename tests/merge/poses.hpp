// Poses in few words
#pragma once

#include <Eigen/Core>

#include "unimapper/core/pose.hpp"

namespace unimapper::merge::testing {

inline Pose turned_about(const Eigen::Vector3d& axis, double rad,
                         const Eigen::Vector3d& t = Eigen::Vector3d::Zero()) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(rad, axis.normalized())), t};
}

inline Pose yaw_pose(double rad, const Eigen::Vector3d& t = Eigen::Vector3d::Zero()) {
  return turned_about(Eigen::Vector3d::UnitZ(), rad, t);
}

inline Pose shifted(double x, double y = 0.0, double z = 0.0) {
  return {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(x, y, z)};
}

inline double apart_m(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).norm();
}

}  // namespace unimapper::merge::testing
