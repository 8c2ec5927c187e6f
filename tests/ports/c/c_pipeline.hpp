// Pipeline behind the C interface, in a block of its own, and a drive past a walker.
#pragma once

#include <cstdlib>
#include <stdexcept>

#include "ports/c/unimapper.h"
#include "tests/onboard/scene.hpp"
#include "unimapper/core/owned.hpp"

namespace unimapper::test {

/// The C twin of small_config() in tests/onboard/run.hpp.
inline um_config small_c_config() {
  um_config config;
  if (um_config_init(&config, UM_SENSOR_HDL_64E) != UM_OK) std::abort();
  config.keyframe_max_points_per_scan = 40000;
  config.voxel_max_cells = 1U << 16U;
  if (um_config_set(&config, "voxel.max_voxels", "8192", nullptr) != UM_OK) std::abort();
  config.loop_search_max_places = 20;
  return config;
}

inline um_points points_of(const LabelledScan& scan) {
  return {scan.points.data(), scan.points.size(), sizeof(Eigen::Vector3f), 0, 4, 8};
}

inline um_pose pose_of(const Pose& pose) {
  um_pose out;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.m[4 * row + column] = pose.rotation(row, column);
    out.m[4 * row + 3] = pose.translation(row);
  }
  return out;
}

/// A wall, a walker and a robot that drives past: 30 scans, 3 keyframes.
inline constexpr int kScans = 30;
inline Pose driving(int scan) { return sensor_at(0.1 * scan, 0.0, 0.01 * scan); }
inline std::int64_t stamp_of(int scan) { return 1 + scan * std::int64_t{100000000}; }
inline const LabelledScan& walker_scan(int scan) {
  static const std::vector<LabelledScan> scans = [] {
    Scene scene;
    scene.columns = 360;
    scene.boxes = {standing_box({8.0, 6.0, 1.5}, {6.0, 0.3, 1.5}),
                   moving_box({8.0, -4.0, 0.9}, {0.0, 1.4, 0.0}, {0.25, 0.25, 0.9})};
    std::vector<LabelledScan> all;
    for (int i = 0; i < kScans; ++i) all.push_back(scene.scan(driving(i), 0.1 * i));
    return all;
  }();
  return scans.at(static_cast<std::size_t>(scan));
}

class CPipeline {
 public:
  explicit CPipeline(const um_config& config = small_c_config())
      : block_(um_required_bytes(&config)) {
    if (um_init(&config, block_.data(), block_.size(), &handle_, nullptr) != UM_OK) std::abort();
  }
  operator um_pipeline*() const { return handle_; }

  /// Adds points seen from the start of the drive.
  um_status add(const um_points& points, std::int64_t stamp_ns) const {
    const um_pose pose = pose_of(driving(0));
    return um_add_scan(handle_, &points, &pose, stamp_ns, nullptr);
  }
  /// Adds a scan of the drive; true if there is a keyframe.
  [[nodiscard]] bool step(int scan) const {
    const um_points points = points_of(walker_scan(scan));
    const um_pose pose = pose_of(driving(scan));
    std::int32_t ready = -1;
    expect(um_add_scan(handle_, &points, &pose, stamp_of(scan), &ready));
    return ready == 1;
  }
  /// Adds them all and calls `look` whenever there is a keyframe.
  template <typename Look>
  void drive(const Look& look) const {
    for (int scan = 0; scan < kScans; ++scan) {
      if (step(scan)) look();
    }
  }
  [[nodiscard]] um_keyframe keyframe() const {
    um_keyframe keyframe;
    expect(um_keyframe_get(handle_, &keyframe));
    return keyframe;
  }
  [[nodiscard]] um_health health() const {
    um_health health;
    expect(um_health_get(handle_, &health));
    return health;
  }

 private:
  static void expect(um_status status) {
    if (status != UM_OK) throw std::runtime_error(um_status_text(status));
  }

  MemoryBlock block_;
  um_pipeline* handle_ = nullptr;
};

}  // namespace unimapper::test
