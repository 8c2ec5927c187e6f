// Classification of connected components
#pragma once

#include <cstdint>
#include <span>

#include "block_window.hpp"
#include "component_tally.hpp"
#include "seen_through_clusters.hpp"
#include "src/free_space/component_outline.hpp"
#include "src/free_space/components.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/slice.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Where a keyframe was seen from, and how closely.
struct Viewpoint {
  Eigen::Vector3f sensor_m = Eigen::Vector3f::Zero();  ///< from the grid's origin
  float ray_spacing_deg = 0.0F;                        ///< on one ring; 0: not known
  float stray_range_m = 0.0F;                          ///< `onboard::stray_range_m`
};

/// Labels candidate cells that touch (`ComponentLabels`) and classifies each component as a whole:
/// if most of the evidence for its cells says dynamic all of it is, if hardly any does none of it.
/// Low and confirmed static cells and stray returns connect nothing, and cells whose own evidence
/// is strong keep their label: a walker who brushes past a wall, or past what was never seen
/// before, is not part of it (`SeenThroughClusters`). A component that was dynamic in the keyframe
/// before stays so, which keeps a car that has just parked, or a pedestrian who has just stopped,
/// out of the map. What is as thin as a pole is not seen through by rays that pass on either side
/// of it.
class ComponentClassifier {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Begins with the candidates of a keyframe.
  void begin() noexcept;
  /// Does the next part of classifying the candidates of `cells`, whose evidence is `log_odds`
  /// (thousandths, by row): with `deferred` 4,096 blocks of one of its loops. False once all is
  /// done, in O(candidates), nearly; neighbours are looked up
  /// block-wise.
  bool step(const BlockWindow& window, std::span<const std::int16_t> log_odds,
            const Viewpoint& viewpoint, CellTable& cells) noexcept;
  /// What that costs, about (`slice_cost`).
  [[nodiscard]] std::uint32_t step_cost() const noexcept;
  /// Blocks without room for their parts, whose cells therefore stand together.
  [[nodiscard]] std::uint32_t crowded() const noexcept { return labels_.crowded(); }
  /// Number of components with a sign that they may be dynamic, once all is done.
  [[nodiscard]] std::uint32_t components() const noexcept { return components_; }

 private:
  /// Its loops, in their order.
  enum class Task : std::uint8_t { kSplit, kSpread, kFollow, kCount, kMark, kClusters, kDone };

  /// What becomes of a component.
  enum class Outcome : std::uint8_t {
    kThin,      ///< static: rays beside it may be all that saw through
    kPersists,  ///< dynamic, as in the keyframe before
    kDynamic,   ///< by its evidence
    kStatic,    ///< by its evidence; clusters within it may be dynamic
    kMixed,     ///< each cell by its own evidence
  };

  /// Cells of a block that follow a component without connecting any: also those confirmed static,
  /// unless they were proven dynamic in the keyframe before.
  [[nodiscard]] std::uint64_t followers(const BlockWindow& window, const CellTable& cells,
                                        std::uint32_t b) const noexcept {
    const CellMarks& marks = cells.marks(b);
    if (config_.confirmed_static_connects || marks.confirmed_static == 0) return marks.follower;
    return marks.follower | (marks.confirmed_static & ~window.before(b).proven);
  }

  /// Cells of a block that are dynamic, or were proven so in the keyframe before: a component
  /// without any is static.
  [[nodiscard]] static std::uint64_t signs_of(const BlockWindow& window, const CellTable& cells,
                                              std::uint32_t b) noexcept {
    const CellMarks& marks = cells.marks(b);
    return marks.candidate == 0 ? 0 : marks.dynamic | window.before(b).proven;
  }
  void count(const BlockWindow& window, std::span<const std::int16_t> log_odds,
             const CellTable& cells, Slice some) noexcept;
  void count_cells(ComponentTally& tally, std::uint64_t cells, const Block& block,
                   std::span<const std::int16_t> log_odds,
                   const BlockHistory& before) const noexcept;
  void decide_all(const Viewpoint& viewpoint) noexcept;
  void mark(CellTable& cells, Slice some) noexcept;
  /// Whether all evidence of free space for a component may come from rays beside it.
  [[nodiscard]] bool may_be_missed(const ComponentTally& tally, Outline outline,
                                   const Viewpoint& viewpoint) const noexcept;
  [[nodiscard]] Outcome decide(const ComponentTally& tally,
                               const Viewpoint& viewpoint) const noexcept;
  /// Some cells of block `b`.
  void mark_block(std::uint32_t b, std::uint64_t cells, Outcome outcome, CellMarks& marks) noexcept;
  [[nodiscard]] bool persists(const ComponentTally& tally) const noexcept;

  RemovalConfig config_;
  std::uint32_t slice_blocks_ = 0;
  float cell_m_ = 0.2F;
  std::int32_t confirmed_static_ = 0;  ///< thousandths; clamp of a cell's evidence
  Task task_ = Task::kDone;
  SlicedLoop loop_;
  std::uint32_t components_ = 0;
  ComponentLabels labels_;
  ComponentTally* tally_ = nullptr;  ///< by component
  Outcome* outcome_ = nullptr;       ///< by component
  SeenThroughClusters clusters_;
};

}  // namespace unimapper::onboard
