// Lower-bound baseline: one voxel-hashing pass over a scan.
#pragma once

#include <cstdint>
#include <vector>

#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::bench {

/// Reads every point, computes and hashes its voxel key, and counts it in a table as large as the
/// pipeline's own: no transform, no range check, no collisions. Stage times as multiples of
/// this pass are comparable between machines.
class HashingBaseline {
 public:
  explicit HashingBaseline(const PipelineConfig& config);

  /// O(points).
  void read_and_hash(const PointView& points) noexcept;

 private:
  float cells_per_metre_;
  std::vector<std::uint32_t> counts_;
};

}  // namespace unimapper::bench
