#include "bench/places/synthetic_place.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace unimapper::bench {
namespace {

void add_half(const OwnedPlace& from, double yaw, bool left, OwnedPlace& to) {
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(static_cast<float>(yaw), Eigen::Vector3f::UnitZ()).toRotationMatrix();
  for (Keypoint keypoint : from.keypoints) {
    keypoint.position = turn * keypoint.position;
    keypoint.normal = turn * keypoint.normal;
    if ((keypoint.position.y() >= 0.0F) == left) to.keypoints.push_back(keypoint);
  }
  for (PlanePatch plane : from.planes) {
    plane.center = turn * plane.center;
    plane.normal = turn * plane.normal;
    if ((plane.center.y() >= 0.0F) == left) to.planes.push_back(plane);
  }
}

}  // namespace

OwnedPlace mix_halves(const OwnedPlace& a, double yaw_a, const OwnedPlace& b, double yaw_b,
                      const PlaceCapacity& capacity) {
  OwnedPlace mixed;
  add_half(a, yaw_a, true, mixed);
  add_half(b, yaw_b, false, mixed);
  std::stable_sort(mixed.keypoints.begin(), mixed.keypoints.end(),
                   [](const Keypoint& x, const Keypoint& y) { return x.strength > y.strength; });
  mixed.keypoints.resize(std::min(mixed.keypoints.size(), capacity.keypoints));
  mixed.planes.resize(std::min(mixed.planes.size(), capacity.planes));
  return mixed;
}

}  // namespace unimapper::bench
