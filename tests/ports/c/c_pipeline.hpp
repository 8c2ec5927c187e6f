// Pipeline behind the C interface, in a block of its own.
#pragma once

#include <cstdlib>

#include "ports/c/unimapper.h"
#include "tests/onboard/scene.hpp"
#include "unimapper/core/owned.hpp"

namespace unimapper::test {

/// The C twin of small_config() in tests/onboard/run.hpp.
inline um_config small_c_config() {
  um_config config;
  if (um_config_init(&config, sizeof config, UM_SENSOR_HDL_64E) != UM_OK) std::abort();
  config.keyframe_max_points_per_scan = 40000;
  config.voxel_max_cells = 1U << 16U;
  if (um_config_set(&config, "voxel.max_voxels", "8192", nullptr) != UM_OK) std::abort();
  config.loop_search_max_places = 20;
  return config;
}

class CPipeline {
 public:
  explicit CPipeline(const um_config& config = small_c_config())
      : block_(um_required_bytes(&config)) {
    if (um_init(&config, block_.data(), block_.size(), &handle_, nullptr) != UM_OK) std::abort();
  }
  um_pipeline* get() const { return handle_; }

 private:
  MemoryBlock block_;
  um_pipeline* handle_ = nullptr;
};

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
inline Scene scene_with_walker() {
  Scene scene;
  scene.columns = 360;
  scene.boxes = {standing_box({8.0, 6.0, 1.5}, {6.0, 0.3, 1.5}),
                 moving_box({8.0, -4.0, 0.9}, {0.0, 1.4, 0.0}, {0.25, 0.25, 0.9})};
  return scene;
}
inline Pose driving(int scan) { return sensor_at(0.1 * scan, 0.0, 0.01 * scan); }

}  // namespace unimapper::test
