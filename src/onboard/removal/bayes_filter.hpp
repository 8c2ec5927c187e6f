// Recursive binary Bayes filter over the sliding window
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "evidence_window.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/slice.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/free_space/evidence_weights.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Decides for each candidate cell whether it was free (paper section IV-D, equation 6
/// and algorithm 1). Log-odds of "dynamic" start at zero; every measurement of the window adds its
/// share: seen through or in a free column, occupied, or a surface about there. A cell without
/// evidence stays at zero and thereby static.
///
/// The filter is recursive: a cell that was a candidate in the keyframe before keeps its sum,
/// clamped, and only newer evidence is added. Any other cell is weighed by the whole window. That
/// is an order of magnitude less work, for most cells are observed again.
class BayesFilter {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Begins to mark the candidates of `cells` whose probability exceeds one half as dynamic.
  /// O(cells).
  void begin(const EvidenceWindow& window, const CellTable& cells) noexcept;
  /// Decides about the next ones. With `deferred` these are 4,096 blocks, or fewer that need
  /// `kSliceProjections`; 16 blocks at least. False once none is left.
  bool step(const EvidenceWindow& window, CellTable& cells) noexcept;
  /// Projections into images after which a slice ends.
  static constexpr std::uint32_t kSliceProjections = 1U << 16U;
  /// With `deferred`: projections into images that the next slice needs, and its blocks.
  [[nodiscard]] std::uint32_t step_projections() const noexcept;
  [[nodiscard]] std::uint32_t step_blocks() const noexcept { return next_slice().size(); }
  /// Images that a new candidate is projected into.
  [[nodiscard]] std::uint32_t images() const noexcept { return images_; }

  /// Forgets the sums of the keyframe that was decided last: the next one goes on from those
  /// before.
  void discard() noexcept { std::swap(sums_, sums_before_); }

  /// Log-odds, once none is left: thousandths, by row; only those of candidates mean anything.
  [[nodiscard]] std::span<const std::int16_t> log_odds() const noexcept {
    return {sums_before_, rows_};
  }

 private:
  /// Candidates are processed in groups that stay in the first-level cache while every
  /// measurement adds its share.
  static constexpr std::uint32_t kGroup = 2048;
  struct Group;
  /// Candidates that a worker has not decided about yet. Every block has one worker.
  struct Worker;

  /// Blocks whose projections are counted together.
  static constexpr std::uint32_t kRun = 16;
  static constexpr std::uint32_t kSliceBlocks = 4096;

  [[nodiscard]] bool is_deferred() const noexcept { return slice_blocks_ != UINT32_MAX; }
  /// Takes the next blocks, and with `deferred` counts what they need, for the slices to come.
  void begin_slices(const EvidenceWindow& window, const CellTable& cells) noexcept;
  /// New candidates of a block.
  [[nodiscard]] std::uint32_t new_of(const EvidenceWindow& window, const CellTable& cells,
                                     std::uint32_t block) const noexcept;
  /// The blocks of the next slice: as many runs as it affords, one at least.
  [[nodiscard]] Slice next_slice() const noexcept;
  /// Does some blocks, but for the candidates that are left in the worker's groups.
  void collect_all(const EvidenceWindow& window, CellTable& cells, Slice blocks,
                   Worker& worker) noexcept;
  /// Starts loading what is known of a block, if there is one of that number.
  void prefetch(const BlockWindow& blocks, std::uint32_t block) const noexcept;
  /// Puts the candidates of a block into the group they belong to.
  void collect(const EvidenceWindow& window, const CellTable& cells, std::uint32_t block,
               Worker& worker) const noexcept;
  void finish_known(const EvidenceWindow& window, CellTable& cells, Group& known) noexcept;
  void finish_new(const EvidenceWindow& window, CellTable& cells, Group& fresh) noexcept;
  void add_columns(Group& group, const BlockWindow& blocks, const KeyframeEvidence& evidence,
                   std::uint32_t age, const CellTable& cells) const noexcept;
  void decide(Group& group, CellTable& cells) noexcept;

  FreeSpaceConfig free_space_;
  /// Thousandths.
  struct LogOdds {
    EvidenceWeights weights;
    std::int32_t confirmed_static;
    std::int32_t confirmed_dynamic;
    std::int32_t clamp;  ///< of what is carried on; 0: nothing is
    std::int32_t store;  ///< clamp of what is stored: at least `confirmed_static`
  };
  LogOdds log_odds_{};
  Executor executor_;
  Worker* workers_ = nullptr;
  std::uint32_t slice_blocks_ = 0;

  /// Sums by row, of this keyframe and of the one before; `kNoCandidate` for all others.
  static constexpr std::int16_t kNoCandidate = INT16_MIN;
  std::uint32_t rows_ = 0;  ///< of the last run
  SlicedLoop loop_;
  Slice slice_{};                   ///< blocks that were counted and are not decided about yet
  std::uint32_t slices_begin_ = 0;  ///< the first block that was counted with them
  std::uint32_t projections_[kSliceBlocks / kRun];  ///< by run from there on
  std::uint32_t images_ = 0;                        ///< that a new candidate is projected into
  std::uint32_t latest_images_ = 0;                 ///< that any other one is
  std::int16_t* sums_ = nullptr;
  std::int16_t* sums_before_ = nullptr;
};

}  // namespace unimapper::onboard
