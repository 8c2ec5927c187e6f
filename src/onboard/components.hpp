// Connected obstacles, decided as a whole.
#pragma once

#include <cstdint>
#include <span>

#include "block_window.hpp"
#include "cell_table.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Joins candidate cells that touch (26 neighbours) and settles each component as a whole: if the
/// evidence for its cells mostly says dynamic all of it is, if hardly any does none of it. A
/// component that was dynamic in the keyframe before stays so, which is what keeps a car that has
/// just parked, or a walker who has just stopped, out of the map.
class Components {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Settles the candidates of `cells`, for which `log_odds` (thousandths, by row) were found.
  /// Returns the number of components.
  /// O(candidates), nearly; neighbours are looked up block-wise.
  std::uint32_t run(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                    CellTable& cells) noexcept;

 private:
  /// Cells of one block that touch each other: the smallest thing a component is made of.
  struct Part {
    std::uint64_t cells;   ///< connecting ones, one bit each
    std::uint32_t parent;  ///< union-find; a root is its own parent
  };
  /// What is known of a component, kept at its root part.
  struct Tally {
    std::uint32_t cells;
    std::uint32_t evidence;          ///< magnitudes of the cells' log-odds, each up to the firm one
    std::uint32_t evidence_dynamic;  ///< of those that say dynamic
    std::uint32_t was_dynamic;
    std::uint32_t was_static;
  };
  /// The parts of a block follow each other.
  struct Parts {
    std::uint32_t first;
    std::uint32_t count;
  };
  void split_into_parts(const CellTable& cells) noexcept;
  void join_parts(const BlockWindow& window, const CellTable& cells) noexcept;
  /// Joins the parts of a block with those of its neighbour at `kOffsets[offset]` they touch.
  void join_blocks(std::uint32_t block, std::uint32_t other, std::size_t offset) noexcept;
  void attach_low_cells(const BlockWindow& window, const CellTable& cells) noexcept;
  std::uint32_t count(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                      const CellTable& cells) noexcept;
  void count_part(Tally& tally, std::uint64_t cells, const Block& block,
                  std::span<const std::int16_t> log_odds,
                  const BlockHistory& before) const noexcept;
  void settle(CellTable& cells) noexcept;
  /// Settles some cells of a block as their component was decided.
  void settle_cells(std::uint64_t cells, std::uint32_t part, CellMarks& marks) noexcept;
  [[nodiscard]] bool persists(const Tally& tally) const noexcept;

  /// The part of block `block` that holds any of `cells`, or `kNoPart`.
  [[nodiscard]] std::uint32_t part_with(std::uint32_t block, std::uint64_t cells) const noexcept;
  std::uint32_t root(std::uint32_t part) noexcept;
  void join(std::uint32_t a, std::uint32_t b) noexcept;

  static constexpr std::uint32_t kNoPart = 0xFFFFFFFFU;

  RemovalConfig config_;
  std::int32_t firm_ = 0;  ///< thousandths
  std::uint32_t block_count_ = 0;
  std::uint32_t part_count_ = 0;
  std::uint32_t max_parts_ = 0;
  Parts* parts_of_ = nullptr;  ///< by block
  Part* parts_ = nullptr;
  Tally* tally_ = nullptr;                ///< per part
  std::uint32_t* part_of_low_ = nullptr;  ///< per row
};

}  // namespace unimapper::onboard
