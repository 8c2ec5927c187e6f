#include "dynamic_removal.hpp"

#include <algorithm>

#include "ground.hpp"

namespace unimapper::onboard {

void DynamicRemoval::allocate(Arena& arena) noexcept { filter_.allocate(arena, config_); }

void DynamicRemoval::allocate_scratch(Arena& arena) noexcept {
  voxels_.allocate(arena, config_.voxel);
  transparent_.allocate(arena, config_);
  levels_.allocate(arena, config_);
  classifier_.allocate(arena, config_);
}

void DynamicRemoval::weigh(const ScanAccumulator& scans, const Viewpoint& viewpoint,
                           EvidenceWindow& window, Budget& budget) noexcept {
  window.blocks().arrange(scans.cells().occupied());
  cells_.build(scans.cells(), window.blocks().order(), scans.grid());
  voxels_.build(cells_);
  ground_voxels_ = find_ground_and_split(viewpoint, window);
  // The paper's columns alone count every occupied cell.
  if (config_.free_space.visibility) window.leave_out_ground(cells_);
  if (config_.free_space.columns) {
    window.current().columns.build(
        cells_.blocks(), [this](std::uint32_t b) noexcept { return cells_.marks(b).ground; });
  }
  limit_ = shed_far_cells(viewpoint, budget);
  // What does not depend on the number of cells must not look like the cost of a few.
  constexpr std::uint32_t kFewest = 1024;
  budget.measure(Budget::Part::kFiltering, std::max(limit_.kept, kFewest),
                 [&] { filter_.run(window, cells_); });
}

std::uint32_t DynamicRemoval::find_ground_and_split(const Viewpoint& viewpoint,
                                                    const EvidenceWindow& window) noexcept {
  std::uint32_t ground =
      find_ground(config_.ground, config_.voxel.coarse_size_m, viewpoint.sensor_m, voxels_.map());
  ground -= transparent_.reject(window, cells_, voxels_);
  ground -= levels_.reject_elevated(voxels_.map());
  propagate_ground(config_.ground, voxels_.map());
  split_ground(config_.ground, config_.removal, voxels_, cells_);
  return ground;
}

RangeLimit DynamicRemoval::shed_far_cells(const Viewpoint& viewpoint,
                                          const Budget& budget) noexcept {
  if (!budget.is_on()) return {};
  return keep_nearest(cells_, viewpoint.sensor_m, config_.keyframe.range_max_m,
                      budget.affordable_cells());
}

void DynamicRemoval::classify(const BlockWindow& blocks, const Viewpoint& viewpoint) noexcept {
  if (!config_.removal.components) return;
  components_ = classifier_.run(blocks, filter_.log_odds(), viewpoint, cells_);
}

void DynamicRemoval::tell(Keyframe& keyframe) const noexcept {
  keyframe.statistics.ground_voxels = ground_voxels_;
  keyframe.statistics.components = components_;
  keyframe.statistics.removal_range_m = limit_.range_m;
  keyframe.shed(Shed::kFarCells) = limit_.shed;
  keyframe.statistics.voxels = voxels_.map().size();
  keyframe.dropped(DropCause::kVoxelsFull) = voxels_.left_out();
  keyframe.use(Capacity::kVoxels, keyframe.statistics.voxels, config_.voxel.max_voxels);
}

}  // namespace unimapper::onboard
