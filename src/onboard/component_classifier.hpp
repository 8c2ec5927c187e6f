// Classification of connected components
#pragma once

#include <cstdint>
#include <span>

#include "block_window.hpp"
#include "cell_table.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/free_space/components.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Labels candidate cells that touch (`ComponentLabels`) and classifies each component as a whole:
/// if most of the evidence for its cells says dynamic all of it is, if hardly any does none of it.
/// Low and confirmed static cells connect nothing, and cells whose own evidence is strong keep
/// their label: a walker who brushes past a wall, or past what was never seen before, is not part
/// of it. A component that was dynamic in the keyframe before stays so, which keeps a car that has
/// just parked, or a pedestrian who has just stopped, out of the map.
class ComponentClassifier {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Classifies the candidates of `cells`, whose evidence is `log_odds` (thousandths, by row).
  /// Returns the number of components.
  /// O(candidates), nearly; neighbours are looked up block-wise.
  std::uint32_t run(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                    CellTable& cells) noexcept;

 private:
  /// What is known of a component.
  struct Tally {
    std::uint32_t cells;
    std::uint32_t evidence;          ///< magnitudes of the cells' log-odds, each clamped
    std::uint32_t evidence_dynamic;  ///< of those that say dynamic
    std::uint32_t was_dynamic;
    std::uint32_t was_static;
  };

  /// Cells of a block that follow a component without connecting any: low ones, and those confirmed
  /// static, unless they were proven dynamic in the keyframe before.
  [[nodiscard]] std::uint64_t followers(const BlockWindow& window, const CellTable& cells,
                                        std::uint32_t b) const noexcept {
    const CellMarks& marks = cells.marks(b);
    if (config_.confirmed_static_connects || marks.confirmed_static == 0) return marks.low;
    return marks.low | (marks.confirmed_static & ~window.before(b).proven);
  }

  void count(const BlockWindow& window, std::span<const std::int16_t> log_odds,
             const CellTable& cells) noexcept;
  void count_cells(Tally& tally, std::uint64_t cells, const Block& block,
                   std::span<const std::int16_t> log_odds,
                   const BlockHistory& before) const noexcept;
  void classify_all(const BlockWindow& window, CellTable& cells) const noexcept;
  /// Some cells of a block as their component was classified.
  void mark(std::uint64_t cells, const Tally& tally, CellMarks& marks) const noexcept;
  [[nodiscard]] bool persists(const Tally& tally) const noexcept;

  RemovalConfig config_;
  std::int32_t confirmed_static_ = 0;  ///< thousandths; clamp of a cell's evidence
  ComponentLabels labels_;
  Tally* tally_ = nullptr;  ///< by component
};

}  // namespace unimapper::onboard
