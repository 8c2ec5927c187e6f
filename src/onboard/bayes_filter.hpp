// The recursive binary Bayes filter over the sliding window.
#pragma once

#include <cstdint>

#include "cell_table.hpp"
#include "evidence.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Decides for each candidate cell whether its place was free (paper section IV-D, equation 6
/// and algorithm 1). Log-odds of "dynamic" start at zero; every measurement of the window, oldest
/// first, adds its share: seen through or in a free column, occupied, or a surface thereabouts.
/// A cell that nothing was learnt about stays at zero and thereby static.
class BayesFilter {
 public:
  void attach(Arena& arena, const PipelineConfig& config) noexcept;

  /// Marks the candidates whose probability exceeds one half as dynamic.
  /// O(candidates x (images + window)).
  void run(const EvidenceWindow& window, const ImageProjection& projection,
           CellTable& cells) noexcept;

 private:
  /// Candidates are worked through in groups that stay in the nearest cache while every
  /// measurement of the window adds its share.
  static constexpr std::uint32_t kGroup = 2048;
  struct Group;

  /// Gathers the candidates of some blocks, weighed by how often they were occupied before.
  /// Returns the first block that did not fit.
  std::uint32_t collect(const BlockWindow& window, const CellTable& cells,
                        std::uint32_t first_block) noexcept;
  void add_window(const EvidenceWindow& window, const ImageProjection& projection,
                  const CellTable& cells) noexcept;
  void add_columns(const BlockWindow& blocks, const KeyframeEvidence& evidence, std::uint32_t age,
                   const CellTable& cells) noexcept;
  void add_image(const RangeImage& image, const ImageProjection& projection,
                 const Eigen::Vector3f& image_grid_from_cells_m) noexcept;
  void decide(CellTable& cells) const noexcept;

  FreeSpaceConfig free_space_;
  /// Whole thousandths: evidence for and against often weighs the same, and rounding must not
  /// decide such a tie.
  struct LogOdds {
    std::int32_t free;
    std::int32_t occupied;
    std::int32_t weakly_occupied;
    std::int32_t firm;
  };
  LogOdds log_odds_{};
  Group* group_ = nullptr;
};

}  // namespace unimapper::onboard
