#include "dynamic_removal.hpp"

#include <algorithm>

#include "ground.hpp"
#include "src/onboard/slice_cost.hpp"

namespace unimapper::onboard {

void DynamicRemoval::allocate(Arena& arena) noexcept { filter_.allocate(arena, config_); }

void DynamicRemoval::allocate_scratch(Arena& arena) noexcept {
  voxels_.allocate(arena, config_.voxel);
  transparent_.allocate(arena, config_);
  levels_.allocate(arena, config_);
  classifier_.allocate(arena, config_);
}

void DynamicRemoval::begin(const Grid& grid, const Viewpoint& viewpoint) noexcept {
  cells_.begin(grid);
  viewpoint_ = viewpoint;
  stage_ = Stage::kArrangement;
  loop_.begin();
}

bool DynamicRemoval::step(const CellStore& store, EvidenceWindow& window) noexcept {
  if (!do_slice(store, window)) {
    stage_ = static_cast<Stage>(static_cast<std::uint8_t>(stage_) + 1U);
    loop_.begin();
  }
  return stage_ != Stage::kDone;
}

std::uint32_t DynamicRemoval::step_cost(std::uint32_t blocks) const noexcept {
  switch (stage_) {
    case Stage::kArrangement:
      return slice_cost::arrangement(blocks);
    case Stage::kTable:
      return slice_cost::kTable;
    case Stage::kMoments:
      return slice_cost::kMoments;
    case Stage::kPlanes:
      return slice_cost::kPlanes;
    case Stage::kGround:
      return slice_cost::ground(blocks);
    case Stage::kTransparentGround:
      return slice_cost::transparent_ground(blocks);
    case Stage::kGroundLevels:
      return slice_cost::ground_levels(blocks);
    case Stage::kSplit:
      return slice_cost::kSplit;
    case Stage::kOccupancy:
      return slice_cost::occupancy(blocks);
    case Stage::kEvidence:
      return slice_cost::evidence(filter_.images());
    case Stage::kComponents:
      return slice_cost::kComponents;
    case Stage::kDone:
      break;
  }
  return 0;
}

bool DynamicRemoval::do_slice(const CellStore& store, EvidenceWindow& window) noexcept {
  constexpr std::uint32_t kMostBlocks = 4096;
  constexpr std::uint32_t kMostPlanes = 2048;
  const auto next_blocks = [&]() noexcept { return loop_.next(store.block_count(), kMostBlocks); };
  FixedHashMap<CoarseVoxel>& voxels = voxels_.map();
  switch (stage_) {
    case Stage::kArrangement:
      window.blocks().arrange(store.occupied());
      return false;
    case Stage::kTable:
      cells_.add(store, window.blocks().order(), next_blocks());
      if (!loop_.is_over()) return true;
      voxels_.begin();  // they lie where the sums did
      return false;
    case Stage::kMoments:
      voxels_.add(cells_, next_blocks());
      return !loop_.is_over();
    case Stage::kPlanes:
      voxels_.find_planes(cells_.grid(), loop_.next(voxels.size(), kMostPlanes));
      return !loop_.is_over();
    case Stage::kGround:
      ground_voxels_ = find_ground(config_.voxel.coarse_size_m, viewpoint_.sensor_m, voxels);
      return false;
    case Stage::kTransparentGround:
      ground_voxels_ -= transparent_.reject(window, cells_, voxels_);
      return false;
    case Stage::kGroundLevels:
      ground_voxels_ -= levels_.reject_elevated(voxels);
      propagate_ground(config_.ground, voxels);
      return false;
    case Stage::kSplit:
      split_ground(config_.ground, config_.removal, voxels_,
                   {viewpoint_.sensor_m, viewpoint_.stray_range_m}, next_blocks(), cells_);
      return !loop_.is_over();
    case Stage::kOccupancy:
      prepare_evidence(window);
      return false;
    case Stage::kEvidence:
      return filter_.step(window, cells_);
    case Stage::kComponents:
      return config_.removal.components &&
             classifier_.step(window.blocks(), filter_.log_odds(), viewpoint_, cells_);
    case Stage::kDone:
      break;
  }
  return true;  // nothing follows
}

void DynamicRemoval::prepare_evidence(EvidenceWindow& window) noexcept {
  // The paper's columns alone count every occupied cell.
  if (config_.free_space.visibility) window.leave_out_ground(cells_);
  if (config_.free_space.columns) {
    window.current().columns.build(
        cells_.blocks(), [this](std::uint32_t b) noexcept { return cells_.marks(b).ground; });
  }
  filter_.begin(window, cells_);
  classifier_.begin();
}

void DynamicRemoval::tell(Keyframe& keyframe) const noexcept {
  keyframe.statistics.ground_voxels = ground_voxels_;
  keyframe.statistics.components = config_.removal.components ? classifier_.components() : 0;
  keyframe.statistics.voxels = voxels_.map().size();
  keyframe.dropped(DropCause::kVoxelsFull) = voxels_.left_out();
  keyframe.use(Capacity::kVoxels, keyframe.statistics.voxels, config_.voxel.max_voxels);
}

}  // namespace unimapper::onboard
