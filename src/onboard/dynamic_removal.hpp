// Dynamic removal: from the cells of a keyframe to their marks
#pragma once

#include <cstdint>

#include "bayes_filter.hpp"
#include "budget.hpp"
#include "cell_table.hpp"
#include "coarse_voxels.hpp"
#include "component_classifier.hpp"
#include "evidence_window.hpp"
#include "ground_levels.hpp"
#include "keyframe.hpp"
#include "range_limit.hpp"
#include "scan_accumulator.hpp"
#include "transparent_ground.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// The stages of the paper's overview figure between a keyframe's cells and its labels, in their
/// order: voxels and ground (section IV-B), evidence of the window (IV-C, IV-D), components.
class DynamicRemoval {
 public:
  explicit DynamicRemoval(const PipelineConfig& config) noexcept : config_(config) {}
  void allocate(Arena& arena) noexcept;
  /// What is in use only from the layout of a keyframe's cells until its labels are written down:
  /// the table of the cells, and what works on it.
  void allocate_table(Arena& arena) noexcept { cells_.allocate(arena, config_.voxel); }
  void allocate_scratch(Arena& arena) noexcept;

  /// Lays the cells of the scans out, tells ground from candidates and weighs the evidence for
  /// those, of the nearest ones as far as the budget goes. O(cells x images of the window).
  void weigh(const ScanAccumulator& scans, const Viewpoint& viewpoint, EvidenceWindow& window,
             Budget& budget) noexcept;
  /// Decides about connected candidates. O(candidates), nearly.
  void classify(const BlockWindow& blocks, const Viewpoint& viewpoint) noexcept;
  /// Writes down what was counted.
  void tell(Keyframe& keyframe) const noexcept;

  /// Of the last keyframe.
  [[nodiscard]] CellTable& cells() noexcept { return cells_; }
  [[nodiscard]] CoarseVoxels& voxels() noexcept { return voxels_; }

 private:
  std::uint32_t find_ground_and_split(const Viewpoint& viewpoint,
                                      const EvidenceWindow& window) noexcept;
  RangeLimit shed_far_cells(const Viewpoint& viewpoint, const Budget& budget) noexcept;

  const PipelineConfig& config_;
  CellTable cells_;
  CoarseVoxels voxels_;
  TransparentGround transparent_;
  GroundLevels levels_;
  BayesFilter filter_;
  ComponentClassifier classifier_;
  std::uint32_t ground_voxels_ = 0;
  std::uint32_t components_ = 0;
  RangeLimit limit_;
};

}  // namespace unimapper::onboard
