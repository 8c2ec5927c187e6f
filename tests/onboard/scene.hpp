// Simulated scene: flat ground, standing and moving boxes, a spinning LiDAR
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::test {

/// What a ray hit.
enum class Truth : std::uint8_t { kGround, kStatic, kDynamic };

/// An upright box; `center` moves with the time in seconds.
struct Box {
  std::function<Eigen::Vector3d(double)> center;
  Eigen::Vector3d half_size;
  Truth truth = Truth::kStatic;
};

inline Box standing_box(const Eigen::Vector3d& center, const Eigen::Vector3d& half_size) {
  return {[center](double) { return center; }, half_size, Truth::kStatic};
}

inline Box moving_box(const Eigen::Vector3d& start, const Eigen::Vector3d& velocity,
                      const Eigen::Vector3d& half_size) {
  return {[start, velocity](double t) { return Eigen::Vector3d(start + velocity * t); }, half_size,
          Truth::kDynamic};
}

inline PointView view_of(const std::vector<Eigen::Vector3f>& points) {
  return PointView::xyz(points.data(), points.size(), sizeof(Eigen::Vector3f));
}

/// Points every 5 cm on a wall 15 m ahead, from 3 m below the sensor to 0.3 m above it.
inline std::vector<Eigen::Vector3f> wall_ahead(float from_y, float to_y) {
  std::vector<Eigen::Vector3f> points;
  for (float y = from_y; y < to_y; y += 0.05F) {
    for (float z = -3.0F; z < 0.3F; z += 0.05F) points.emplace_back(15.0F, y, z);
  }
  return points;
}

/// One scan with what each point really is.
struct LabelledScan {
  std::vector<Eigen::Vector3f> points;
  std::vector<Truth> truth;
  [[nodiscard]] PointView view() const { return view_of(points); }
};

struct Scene {
  std::vector<Box> boxes;
  double ground_z = 0.0;
  int rings = 40;     ///< from -24 to +8 degrees
  int columns = 720;  ///< per turn
  double max_range = 60.0;

  /// What a LiDAR at `T_scene_sensor` sees at time `t`. Rays that meet nothing return nothing.
  [[nodiscard]] LabelledScan scan(const Pose& T_scene_sensor, double t) const {
    LabelledScan result;
    constexpr double kPi = 3.14159265358979;
    for (int ring = 0; ring < rings; ++ring) {
      const double elevation = (-24.0 + 32.0 * ring / (rings - 1)) * kPi / 180.0;
      for (int column = 0; column < columns; ++column) {
        const double azimuth = 2.0 * kPi * column / columns;
        const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        add_hit(T_scene_sensor, ray, t, result);
      }
    }
    return result;
  }

 private:
  void add_hit(const Pose& sensor, const Eigen::Vector3d& ray, double t,
               LabelledScan& result) const {
    const Eigen::Vector3d direction = sensor.rotation * ray;
    double nearest = max_range;
    Truth truth = Truth::kGround;
    bool hit = false;
    if (direction.z() < 0.0) {
      const double range = (ground_z - sensor.translation.z()) / direction.z();
      if (range > 0.0 && range < nearest) {
        nearest = range;
        hit = true;
      }
    }
    for (const Box& box : boxes) {
      const double range = enter(box, sensor.translation, direction, t);
      if (range >= nearest) continue;
      nearest = range;
      truth = box.truth;
      hit = true;
    }
    if (!hit) return;
    result.points.emplace_back((ray * nearest).cast<float>());
    result.truth.push_back(truth);
  }

  /// Where a ray enters a box, or infinity (slab method).
  static double enter(const Box& box, const Eigen::Vector3d& origin,
                      const Eigen::Vector3d& direction, double t) {
    const Eigen::Vector3d center = box.center(t);
    double near = 0.0;
    double far = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double inverse = 1.0 / direction(axis);
      double a = (center(axis) - box.half_size(axis) - origin(axis)) * inverse;
      double b = (center(axis) + box.half_size(axis) - origin(axis)) * inverse;
      if (a > b) std::swap(a, b);
      near = std::max(near, a);
      far = std::min(far, b);
    }
    return near <= far && near > 0.0 ? near : std::numeric_limits<double>::infinity();
  }
};

/// A sensor 1.8 m above the ground, looking along x.
inline Pose sensor_at(double x, double y, double yaw_rad = 0.0) {
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation = {x, y, 1.8};
  return pose;
}

}  // namespace unimapper::test
