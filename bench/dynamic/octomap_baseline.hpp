// OctoMap baseline: dynamic points are those in voxels that are free in the finished map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>

#include "ports/datasets/dataset.hpp"

namespace unimapper::bench {

/// OctoMap's own parameters are its defaults: hit 0.7, miss 0.4, clamped to 0.12 and 0.97, occupied
/// from 0.5 on.
struct OctomapOptions {
  double voxel_m = 0.1;
  /// Beams are inserted up to this range; points beyond leave a free ray and no obstacle. The
  /// benchmark's protocol ignores points beyond it, too.
  double max_range_m = 50.0;
  std::size_t scans = std::numeric_limits<std::size_t>::max();  ///< only the first ones
};

struct OctomapCost {
  std::size_t scans = 0;
  double cpu_ms = 0.0;      ///< insertion of all scans, all threads
  double longest_ms = 0.0;  ///< of one scan
  std::uint64_t tree_bytes = 0;
};

/// Inserts every scan at its pose, then writes OUT/labels/NAME.label: dynamic (251) for a point
/// whose voxel is free in the finished map, static (9) for all others, including
/// those in unknown voxels. Unlike `unimapper onboard`, this uses
/// the scans after a point as well as those before it. Throws DatasetError.
OctomapCost label_with_octomap(const datasets::Dataset& dataset, const OctomapOptions& options,
                               const std::filesystem::path& out);

}  // namespace unimapper::bench
