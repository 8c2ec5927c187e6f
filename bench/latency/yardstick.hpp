// The least any voxel mapper must do with a scan.
#pragma once

#include <cstdint>
#include <vector>

#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::bench {

/// Reads every point, computes and hashes its voxel key, and counts it in a table as large as the
/// pipeline's own: no transform, no range check, no collisions. What a stage takes as a multiple
/// of this pass compares between machines.
class Yardstick {
 public:
  explicit Yardstick(const PipelineConfig& config);

  /// O(points).
  void read_and_hash(const PointView& points) noexcept;

 private:
  float cells_per_metre_;
  std::vector<std::uint32_t> counts_;
};

}  // namespace unimapper::bench
