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
}

void DynamicRemoval::begin(const Grid& grid, const Viewpoint& viewpoint) noexcept {
  cells_.begin(grid);
  viewpoint_ = viewpoint;
  stage_ = 0;
  loop_.begin();
}

/// All stages in their order: what the next slice costs, and the slice; true if more of the stage
/// is left. Lambdas without captures: the compiler sees which one is called.
template <typename Stage>
void DynamicRemoval::list_stages(std::uint32_t blocks, Stage stage) const noexcept {
  stage(slice_cost::arrangement(blocks), [](DynamicRemoval&, const Input& in) noexcept {
    in.window.blocks().arrange(in.store.occupied(), in.executor);
    return false;
  });
  stage(slice_cost::kTable, [](DynamicRemoval& removal, const Input& in) noexcept {
    removal.cells_.add(in.store, in.window.blocks().order(), removal.next_blocks(in), in.executor);
    if (!removal.loop_.is_over()) return true;
    removal.voxels_.begin();  // they lie where the sums did
    return false;
  });
  stage(slice_cost::kMoments, [](DynamicRemoval& removal, const Input& in) noexcept {
    removal.voxels_.add(removal.cells_, removal.next_blocks(in), in.executor);
    return !removal.loop_.is_over();
  });
  stage(slice_cost::kPlanes, [](DynamicRemoval& removal, const Input& in) noexcept {
    const std::uint32_t most = slice_size(removal.config_, 2048);
    for_slices(in.executor, removal.loop_.next(removal.voxels_.map().size(), most), kVoxelsPerPart,
               [&](Slice some, std::uint32_t) noexcept {
                 removal.voxels_.find_planes(removal.cells_.grid(), some);
               });
    return !removal.loop_.is_over();
  });
  stage(slice_cost::ground(blocks), [](DynamicRemoval& removal, const Input&) noexcept {
    removal.ground_voxels_ = find_ground(removal.config_.voxel.coarse_size_m,
                                         removal.viewpoint_.sensor_m, removal.voxels_.map());
    return false;
  });
  const std::uint32_t samples = transparent_.projections(ground_voxels_, filter_.images());
  stage(slice_cost::transparent_ground(blocks, samples),
        [](DynamicRemoval& removal, const Input& in) noexcept {
          removal.ground_voxels_ -=
              removal.transparent_.reject(in.window, removal.cells_, removal.voxels_);
          return false;
        });
  stage(slice_cost::ground_levels(blocks), [](DynamicRemoval& removal, const Input& in) noexcept {
    removal.ground_voxels_ -= removal.levels_.reject_elevated(removal.voxels_.map(), in.executor);
    propagate_ground(removal.config_.ground, removal.voxels_.map());
    return false;
  });
  stage(slice_cost::kSplit, [](DynamicRemoval& removal, const Input& in) noexcept {
    for_slices(in.executor, removal.next_blocks(in), kBlocksPerPart,
               [&](Slice some, std::uint32_t) noexcept {
                 split_ground(removal.config_.ground, removal.config_.removal, removal.voxels_,
                              {removal.viewpoint_.sensor_m, removal.viewpoint_.stray_range_m}, some,
                              removal.cells_);
               });
    return !removal.loop_.is_over();
  });
  stage(slice_cost::occupancy(blocks), [](DynamicRemoval& removal, const Input& in) noexcept {
    removal.prepare_evidence(in.window);
    return false;
  });
  stage(slice_cost::evidence(filter_.step_projections(), filter_.step_blocks()),
        [](DynamicRemoval& removal, const Input& in) noexcept {
          return removal.filter_.step(in.window, removal.cells_);
        });
}

bool DynamicRemoval::step(const CellStore& store, EvidenceWindow& window) noexcept {
  std::uint32_t stages = 0;
  bool is_left = false;
  list_stages(store.block_count(), [&](std::uint32_t, auto slice) noexcept {
    if (stages++ == stage_) is_left = slice(*this, Input{store, window, config_.executor});
  });
  if (is_left) return true;
  loop_.begin();
  return ++stage_ < stages;
}

std::uint32_t DynamicRemoval::step_cost(std::uint32_t blocks) const noexcept {
  std::uint32_t stages = 0;
  std::uint32_t cost = 0;
  list_stages(blocks, [&](std::uint32_t of_stage, auto) noexcept {
    if (stages++ == stage_) cost = of_stage;
  });
  return cost;
}

Slice DynamicRemoval::next_blocks(const Input& in) noexcept {
  return loop_.next(in.store.block_count(), slice_size(config_, 4096));
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
  if (config_.removal.components) {
    keyframe.statistics.components = classifier_.components();
    keyframe.dropped(DropCause::kEvidenceFull) += classifier_.crowded();
  }
  keyframe.statistics.voxels = voxels_.map().size();
  keyframe.dropped(DropCause::kVoxelsFull) = voxels_.left_out();
  keyframe.use(Capacity::kVoxels, keyframe.statistics.voxels, config_.voxel.max_voxels);
}

}  // namespace unimapper::onboard
