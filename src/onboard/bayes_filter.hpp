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
  void collect_candidates(const CellTable& cells) noexcept;
  void add_occupancy(const KeyframeEvidence& evidence, const CellTable& cells) noexcept;
  void add_columns(const KeyframeEvidence& evidence, const CellTable& cells) noexcept;
  void add_image(const RangeImage& image, const ImageProjection& projection,
                 const Eigen::Vector3f& image_grid_from_cells_m) noexcept;
  void clamp() noexcept;

  FreeSpaceConfig free_space_;
  RemovalConfig removal_;
  std::uint32_t size_ = 0;
  // One entry per candidate, in the order of the table's rows.
  std::uint32_t* row_ = nullptr;
  std::uint8_t* bit_ = nullptr;  ///< number within its block
  float* x_ = nullptr;
  float* y_ = nullptr;
  float* z_ = nullptr;
  float* log_odds_ = nullptr;
  std::uint8_t* occupied_ = nullptr;  ///< in the keyframe that is being added
  std::uint32_t block_count_ = 0;
  std::uint32_t* block_end_ = nullptr;  ///< per block: one past its last candidate
};

}  // namespace unimapper::onboard
