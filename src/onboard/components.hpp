// Connected obstacles, decided as a whole.
#pragma once

#include <cstdint>

#include "cell_table.hpp"
#include "evidence.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Joins candidate cells that touch (26 neighbours) and settles each component as a whole: mostly
/// dynamic makes all of it dynamic, hardly dynamic none of it. A component that was dynamic in
/// the keyframe before stays so, which is what keeps a car that has just parked, or a walker who
/// has just stopped, out of the map.
class Components {
 public:
  void attach(Arena& arena, const PipelineConfig& config) noexcept;

  /// Settles the candidates of `cells`. Returns the number of components.
  /// O(candidates), nearly; neighbours are looked up block-wise.
  std::uint32_t run(const EvidenceWindow& window, CellTable& cells) noexcept;

  /// From a cell to one that touches it.
  struct Step {
    std::int32_t x;
    std::int32_t y;
    std::int32_t z;
  };

 private:
  /// The blocks around one block, looked up when first asked for.
  class Surroundings;

  /// What is known of a component, kept at its root.
  struct Tally {
    std::uint32_t cells;
    std::uint32_t dynamic;
    std::uint32_t was_dynamic;
    std::uint32_t was_static;
  };

  void join_neighbours(const CellTable& cells) noexcept;
  void attach_low_cells(const CellTable& cells) noexcept;
  /// Row of the connecting cell one step from cell `bit` of a block, or `CellTable::kNoRow`.
  [[nodiscard]] std::uint32_t connecting_neighbour(Surroundings& surroundings,
                                                   const FixedHashMap<Block>& blocks,
                                                   std::uint32_t bit,
                                                   const Step& step) const noexcept;
  void mark_candidates(const CellTable& cells) noexcept;
  std::uint32_t count(const EvidenceWindow& window, const CellTable& cells) noexcept;
  void settle(CellTable& cells) const noexcept;
  [[nodiscard]] bool persists(const Tally& tally) const noexcept;

  std::uint32_t root(std::uint32_t row) noexcept;
  void join(std::uint32_t a, std::uint32_t b) noexcept;

  RemovalConfig config_;
  std::uint32_t* parent_ = nullptr;
  // Per block, one bit a candidate cell that connects, or that is too low for that.
  std::uint64_t* connecting_ = nullptr;
  std::uint64_t* low_ = nullptr;
  Tally* tally_ = nullptr;
};

}  // namespace unimapper::onboard
