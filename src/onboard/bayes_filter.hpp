// The recursive binary Bayes filter over the sliding window.
#pragma once

#include <cstdint>

#include "cell_table.hpp"
#include "evidence.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Decides for each candidate cell whether its place was free (paper section IV-D, equation 6
/// and algorithm 1). Log-odds of "dynamic" start at zero; every measurement of the window adds its
/// share: seen through or in a free column, occupied, or a surface thereabouts. A cell that
/// nothing was learnt about stays at zero and thereby static.
///
/// The filter is recursive: a cell that was judged in the keyframe before carries its sum on, up
/// to a limit, and only what is new since then is added. Any other cell is weighed by the whole
/// window. That is an order of magnitude less work, for most cells are met again.
class BayesFilter {
 public:
  void attach(Arena& arena, const PipelineConfig& config) noexcept;

  /// Marks the candidates whose probability exceeds one half as dynamic.
  /// O(candidates met again x images of a keyframe + other candidates x (images + window)).
  void run(const EvidenceWindow& window, const ImageProjection& projection,
           CellTable& cells) noexcept;

 private:
  /// Candidates are worked through in groups that stay in the nearest cache while every
  /// measurement adds its share.
  static constexpr std::uint32_t kGroup = 2048;
  struct Group;

  /// Starts loading what is known of a block, if there is one of that number.
  void prefetch(const BlockWindow& blocks, std::uint32_t block) const noexcept;
  /// Puts the candidates of a block into the group they belong to.
  void collect(const EvidenceWindow& window, const CellTable& cells, std::uint32_t block) noexcept;
  void finish_met_again(const EvidenceWindow& window, const ImageProjection& projection,
                        CellTable& cells) noexcept;
  void finish_new(const EvidenceWindow& window, const ImageProjection& projection,
                  CellTable& cells) noexcept;
  void add_columns(Group& group, const BlockWindow& blocks, const KeyframeEvidence& evidence,
                   std::uint32_t age, const CellTable& cells) const noexcept;
  void add_images(Group& group, const KeyframeEvidence& evidence, std::uint32_t stride,
                  const ImageProjection& projection, const CellTable& cells) const noexcept;
  void add_image(Group& group, const RangeImage& image, const ImageProjection& projection,
                 const Eigen::Vector3f& image_grid_from_cells_m) const noexcept;
  /// What it weighs that a cell at this range was seen through, thousandths.
  [[nodiscard]] std::int32_t free_at(float range_m) const noexcept;
  void decide(Group& group, CellTable& cells) noexcept;

  FreeSpaceConfig free_space_;
  /// Whole thousandths: evidence for and against often weighs the same, and rounding must not
  /// decide such a tie.
  struct LogOdds {
    std::int32_t free;
    std::int32_t occupied;
    std::int32_t weakly_occupied;
    std::int32_t firm;
    std::int32_t most_carried;  ///< 0: nothing is carried
  };
  LogOdds log_odds_{};
  Group* met_again_ = nullptr;
  Group* new_ = nullptr;

  /// Sums by row, of this keyframe and of the one before; `kNotJudged` for what was no candidate.
  static constexpr std::int16_t kNotJudged = INT16_MIN;
  std::int16_t* sums_ = nullptr;
  std::int16_t* sums_before_ = nullptr;
};

}  // namespace unimapper::onboard
