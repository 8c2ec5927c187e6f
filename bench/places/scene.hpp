// Drives through one scene with their descriptors.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/places/common_view.hpp"
#include "bench/places/description.hpp"
#include "bench/places/drive.hpp"
#include "bench/places/std_file.hpp"
#include "bench/places/variants.hpp"

namespace unimapper::bench {

/// One drive. Cells of its keyframes are released; views and columns are derived from them.
struct SceneDrive {
  std::string sensor;
  std::string route;
  Drive drive;
  std::vector<ViewVoxels> views;                ///< of every keyframe
  std::vector<OccupiedColumns> columns;         ///< likewise, of 0.5 m
  std::vector<OccupiedColumns> narrow_columns;  ///< likewise, of 0.3 m
  /// Of every `Variant::described_as`: the places.
  std::vector<std::vector<OwnedPlace>> described;
  std::vector<StdKeyframe> std_described;  ///< empty without std.places
};

/// Drives of FOLDER/<sensor>-<route>; missing ones are left out.
struct Scene {
  std::string name;
  std::vector<SceneDrive> drives;

  /// Null if it is not there.
  [[nodiscard]] const SceneDrive* find(const std::string& sensor, const std::string& route) const;
};

/// Reads and describes on all cores. Throws std::runtime_error.
[[nodiscard]] Scene read_scene(const std::filesystem::path& folder,
                               const std::vector<std::string>& sensors,
                               const std::vector<std::string>& routes,
                               const std::vector<Variant>& variants, bool with_std);

}  // namespace unimapper::bench
