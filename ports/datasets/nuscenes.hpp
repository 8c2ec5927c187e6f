// Parser of nuScenes' tables.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::datasets {

/// One sweep of the LiDAR.
struct NuScenesSweep {
  /// Nanoseconds.
  std::int64_t stamp_ns = 0;
  std::string file;     ///< relative to the data set's root
  Pose T_global_lidar;  ///< of the vehicle at that time, and of the LiDAR on it
};

/// Where the text of a table comes from: "scene" gives the content of scene.json.
using NuScenesTable = std::function<std::string(std::string_view name)>;

/// Names of all scenes in scene.json. Throws DatasetError.
[[nodiscard]] std::vector<std::string> parse_nuscenes_scenes(const NuScenesTable& table,
                                                             const std::filesystem::path& folder);

/// The LIDAR_TOP sweeps of scene `name` in order of time. Throws DatasetError where a table is
/// damaged or an entry names another that is missing.
[[nodiscard]] std::vector<NuScenesSweep> parse_nuscenes_sweeps(const NuScenesTable& table,
                                                               const std::string& name,
                                                               const std::filesystem::path& folder);

}  // namespace unimapper::datasets
