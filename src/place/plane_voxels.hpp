// Planar coarse voxels of a keyframe.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "local_ground.hpp"
#include "src/core/fixed_hash_map.hpp"
#include "src/core/fixed_vector.hpp"
#include "src/core/parts.hpp"
#include "src/core/recent_voxels.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::place {

/// True if a plane with this unit normal is inclined by more than 60 degrees.
[[nodiscard]] inline bool is_upright(const Eigen::Vector3f& normal) noexcept {
  return std::abs(normal.z()) < 0.5F;
}

/// Finds the planar coarse voxels (paper section IV-A) among static cells. Every cell counts
/// once, however many points it holds, so the planes do not depend on density or dwell time.
class PlaneVoxels {
 public:
  void allocate(Arena& arena, const DescriptorConfig& config, float voxel_size_m) noexcept;
  /// Takes, after `allocate`, what is in use only from `begin` until the last normal is asked for.
  void allocate_scratch(Arena& arena, const DescriptorConfig& config) noexcept;

  /// Begins anew. What follows may be spread over any number of calls, in this order: all cells
  /// collected, all voxels fitted, then the planes selected. Independent of the cells' order as
  /// long as the capacities hold.
  void begin() noexcept;
  /// Collects cells that are not ground into voxels. O(cells).
  void collect(std::span<const FineCell> structure) noexcept;
  /// Decides of so many further voxels whether they are planes: one eigen decomposition each. False
  /// once none is left.
  bool fit_some(std::uint32_t voxels, const Executor& executor = {}) noexcept;
  /// Adds the planes of `ground` and selects those to keep. O(planes log planes).
  void select(const LocalGround& ground) noexcept;

  /// Planes, upright ones first, then by range: the most informative are kept when there are more
  /// than fit.
  [[nodiscard]] std::span<const PlanePatch> planes() const noexcept { return planes_.view(); }

  /// Unit normal of the plane that structure at `position` borders: the nearest upright plane
  /// among the 27 voxels around, else up.
  [[nodiscard]] Eigen::Vector3f bordering_normal(const Eigen::Vector3f& position) const noexcept;

  /// Voxels that are to be fitted still.
  [[nodiscard]] std::uint32_t unfitted() const noexcept { return voxels_.size() - fitted_; }

  /// Cells and planes refused because a container was full since `begin`.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  // Moments of a voxel's cells relative to its lower corner in 1/512 of its size: integers, so
  // that the sums do not depend on the cells' order. `kMaxCells` of them cannot overflow.
  struct Moments {
    std::uint32_t count;
    std::uint32_t sum[3];
    std::uint32_t product[6];  // xx xy xz yy yz zz
  };
  struct Voxel {
    Moments moments;
    std::uint32_t plane;  // 1 + index of its plane before selection, 0 if none
  };
  static constexpr std::uint32_t kMaxCells = 16384;
  /// Adds a run of cells in one voxel to the table.
  void add(const VoxelIndex& steps, const Moments& run) noexcept;
  bool fit(const Moments& moments, std::uint64_t key, PlanePatch& patch) const noexcept;

  float voxel_size_m_ = 0.0F;
  FixedHashMap<Voxel> voxels_;
  VoxelIndex run_voxel_;  // of the run that the last call of `collect` ended in
  Moments run_{};         // of its cells
  RecentVoxels recent_;
  std::uint32_t fitted_ = 0;
  FixedVector<PlanePatch> all_;
  FixedVector<PlanePatch> planes_;
  FixedVector<std::uint32_t> order_;
  std::uint64_t dropped_ = 0;
};

}  // namespace unimapper::place
