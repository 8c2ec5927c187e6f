// All drives through one scene, made ready for comparison.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/places/described.hpp"
#include "bench/places/drive.hpp"
#include "bench/places/seen.hpp"
#include "bench/places/std_file.hpp"
#include "bench/places/variants.hpp"

namespace unimapper::bench {

/// One drive. The cells of its keyframes are gone; what is left of them is what they show.
struct SceneDrive {
  std::string sensor;
  std::string route;
  Drive drive;
  std::vector<ViewVoxels> views;            ///< of every keyframe
  std::vector<SeenColumns> columns;         ///< likewise, of 0.5 m
  std::vector<SeenColumns> narrow_columns;  ///< likewise, of 0.3 m
  /// Of every `Variant::described_as`: the places.
  std::vector<std::vector<OwnedPlace>> described;
  std::vector<StdKeyframe> std_described;  ///< empty if nobody described it
};

/// Drives lie in FOLDER/<sensor>-<route>; those that are not there are left out.
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
