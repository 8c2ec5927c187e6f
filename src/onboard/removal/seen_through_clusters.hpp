// Clusters of cells that were seen through
#pragma once

#include <cstdint>
#include <span>

#include "block_window.hpp"
#include "component_tally.hpp"
#include "src/free_space/components.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/slice.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Finds what moves within a component that is static as a whole: a walker in front of a wall that
/// came into view with him is a hundred cells of thousands without evidence. Cells that are dynamic
/// by their own evidence and touch are a cluster; one of the size of a person stays dynamic
/// whatever its component is, and so do the cells around it against which hardly anything speaks.
/// On walls and cars false evidence is scattered and low.
class SeenThroughClusters {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Takes in the candidates of `cells` that may belong to a cluster, given their log-odds
  /// (thousandths, by row), of some blocks. Before components are classified.
  /// O(blocks + dynamic cells).
  void collect(std::span<const std::int16_t> log_odds, const CellTable& cells,
               Slice blocks) noexcept;

  /// Cells of block `b` that belong to no cluster: their component is decided about as a whole.
  void leave_out(std::uint32_t b, std::uint64_t some) noexcept {
    if (fewest_ > 0) seen_through_[b] &= ~some;
  }

  /// Labels the clusters and marks those that are large enough as dynamic. `labels` and `tallies`
  /// (as many as there can be parts) are overwritten. O(blocks + dynamic cells).
  void mark(const BlockWindow& window, std::span<const std::int16_t> log_odds,
            ComponentLabels& labels, ComponentTally* tallies, CellTable& cells) const noexcept;

 private:
  /// Marks what touches dynamic cells of block `b` and has hardly any evidence against it.
  void mark_around(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                   std::uint32_t b, std::uint64_t dynamic, CellTable& cells) const noexcept;
  void mark_undecided(std::span<const std::int16_t> log_odds, std::uint32_t b,
                      std::uint64_t touched, CellTable& cells) const noexcept;
  [[nodiscard]] bool is_large(const ComponentTally& tally) const noexcept {
    // Narrower: a pole before a wall.
    return tally.cells >= fewest_ && tally.box.height() >= lowest_ &&
           tally.box.width() > CellBox::kNarrow;
  }

  std::uint32_t fewest_ = 0;               ///< cells; 0: no clusters
  std::int32_t lowest_ = 1;                ///< height in cells
  std::int32_t least_ = 0;                 ///< thousandths, of a cell of a cluster
  std::int32_t against_ = 0;               ///< thousandths that may speak against a cell around it
  std::uint64_t* seen_through_ = nullptr;  ///< by block
};

}  // namespace unimapper::onboard
