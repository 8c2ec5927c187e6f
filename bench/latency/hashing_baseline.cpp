#include "hashing_baseline.hpp"

#include <bit>

#include "unimapper/core/voxel_key.hpp"

namespace unimapper::bench {

HashingBaseline::HashingBaseline(const PipelineConfig& config)
    : cells_per_metre_(1.0F / config.voxel.fine_size_m),
      counts_(std::bit_ceil(std::size_t{config.voxel.max_cells} * 2)) {}

void HashingBaseline::read_and_hash(const PointView& points) noexcept {
  const std::uint64_t mask = counts_.size() - 1;
  for (std::size_t i = 0; i < points.count; ++i) {
    const VoxelIndex cell = voxel_index(points[i], cells_per_metre_);
    ++counts_[mix_bits(pack(cell)) & mask];
  }
}

}  // namespace unimapper::bench
