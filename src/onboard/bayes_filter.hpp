// The recursive binary Bayes filter over the sliding window.
#pragma once

#include <cstdint>
#include <span>

#include "cell_table.hpp"
#include "evidence.hpp"
#include "image_judge.hpp"
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
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Marks the candidates whose probability exceeds one half as dynamic.
  /// O(candidates met again x images of a keyframe + other candidates x (images + window)).
  void run(const EvidenceWindow& window, const ImageProjection& projection,
           CellTable& cells) noexcept;

  /// Log-odds that the last run found, thousandths, by row; meaningless for what is no candidate.
  [[nodiscard]] std::span<const std::int16_t> log_odds() const noexcept {
    return {sums_before_, judged_};
  }

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
  void decide(Group& group, CellTable& cells) noexcept;

  FreeSpaceConfig free_space_;
  ImageJudge images_;
  /// Thousandths.
  struct LogOdds {
    std::int32_t free;
    std::int32_t occupied;
    std::int32_t firm;
    std::int32_t most_carried;  ///< 0: nothing is carried
    std::int32_t most_kept;     ///< at least as much as is firm
  };
  LogOdds log_odds_{};
  Group* met_again_ = nullptr;
  Group* new_ = nullptr;

  /// Sums by row, of this keyframe and of the one before; `kNotJudged` for what was no candidate.
  static constexpr std::int16_t kNotJudged = INT16_MIN;
  std::uint32_t judged_ = 0;  ///< rows of the last run
  std::int16_t* sums_ = nullptr;
  std::int16_t* sums_before_ = nullptr;
};

}  // namespace unimapper::onboard
