// Dynamic removal: from the cells of a keyframe to their marks
#pragma once

#include <cstdint>

#include "bayes_filter.hpp"
#include "component_classifier.hpp"
#include "evidence_window.hpp"
#include "ground_levels.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/keyframe/coarse_voxels.hpp"
#include "src/onboard/keyframe/keyframe.hpp"
#include "src/onboard/keyframe/scan_accumulator.hpp"
#include "src/onboard/slice.hpp"
#include "transparent_ground.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// The stages of the paper's overview figure between a keyframe's cells and its labels, in their
/// order: voxels and ground (section IV-B), evidence of the window (IV-C, IV-D), components. Each
/// is done in slices; when they are done makes no difference to the result.
class DynamicRemoval {
 public:
  explicit DynamicRemoval(const PipelineConfig& config) noexcept : config_(config) {}
  void allocate(Arena& arena) noexcept;
  /// What is in use only from the layout of a keyframe's cells until its labels are written down:
  /// the table of the cells, and what works on it; of that, components until all are classified.
  void allocate_table(Arena& arena) noexcept { cells_.allocate(arena, config_.voxel); }
  void allocate_scratch(Arena& arena) noexcept;
  void allocate_components(Arena& arena) noexcept { classifier_.allocate(arena, config_); }

  /// Begins with the keyframe whose cells these are, and which is the window's current one. No
  /// cell or block is added until all slices are done. O(1).
  void begin(const Grid& grid, const Viewpoint& viewpoint) noexcept;
  /// The next slice. With `deferred` 4,096 blocks of cells or 2,048 plane fits, or
  /// one pass over the coarse voxels, or one over the cells that decides nothing. False once each
  /// cell has its own evidence.
  bool step(const CellStore& store, EvidenceWindow& window) noexcept;
  /// What it costs, about (`slice_cost`), in a keyframe of so many blocks.
  [[nodiscard]] std::uint32_t step_cost(std::uint32_t blocks) const noexcept;
  /// What follows: a slice of the components. One worker does it. False once all cells are
  /// labelled.
  bool classify_step(const EvidenceWindow& window) noexcept {
    return config_.removal.components &&
           classifier_.step(window.blocks(), filter_.log_odds(), viewpoint_, cells_);
  }
  [[nodiscard]] std::uint32_t classify_cost() const noexcept { return classifier_.step_cost(); }

  /// The keyframe leaves no evidence: the next one goes on from the one before.
  void discard() noexcept { filter_.discard(); }

  /// Writes down what was counted.
  void tell(Keyframe& keyframe) const noexcept;

  /// Of the last keyframe.
  [[nodiscard]] CellTable& cells() noexcept { return cells_; }
  [[nodiscard]] CoarseVoxels& voxels() noexcept { return voxels_; }

 private:
  /// What slices read.
  struct Input {
    const CellStore& store;
    EvidenceWindow& window;
    const Executor& executor;
  };

  template <typename Stage>
  void list_stages(std::uint32_t blocks, Stage stage) const noexcept;
  Slice next_blocks(const Input& in) noexcept;
  void prepare_evidence(EvidenceWindow& window) noexcept;

  const PipelineConfig& config_;
  CellTable cells_;
  CoarseVoxels voxels_;
  TransparentGround transparent_;
  GroundLevels levels_;
  BayesFilter filter_;
  ComponentClassifier classifier_;
  std::uint32_t stage_ = 0;  ///< its place in the list
  SlicedLoop loop_;
  Viewpoint viewpoint_;
  std::uint32_t ground_voxels_ = 0;
};

}  // namespace unimapper::onboard
