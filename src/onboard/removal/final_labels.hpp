// Final labels of keyframes evicted from the window
#pragma once

#include <cstdint>
#include <span>

#include "evidence_window.hpp"
#include "src/core/fixed_hash_map.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::onboard {

/// Stores which cells of a keyframe were labelled dynamic and which static without enough evidence,
/// and labels them again when the keyframe is the oldest of the window: by what the keyframes
/// after it saw through and where they observed a surface (the paper's correction of wrong
/// labels). Confirmed static cells, and ground, keep their labels. The undecided cells of a
/// block are labelled together.
class FinalLabels {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Forgets all keyframes, but not the result. Nothing must be in progress.
  void forget() noexcept { stored_ = 0; }

  /// Stores the undecided cells of the current keyframe, number `sequence`, before the window
  /// records it. Every keyframe has the same room; what it is too small for are its farthest
  /// blocks, so that every keyframe is relabelled. O(blocks).
  void store(const EvidenceWindow& window, const CellTable& cells, std::uint32_t sequence) noexcept;

  /// Begins to relabel the keyframe that the next record evicts from the window, by the evidence up
  /// to the current one; false if there is none or it is not stored. With `keeps_result`, `relabel`
  /// applies the last one's result until the first `step`.
  bool begin_evicted(const EvidenceWindow& window, bool keeps_result) noexcept;
  /// Begins to relabel the oldest keyframe there is, after the last record. False if there is none.
  bool begin_oldest(const EvidenceWindow& window) noexcept;
  /// Relabels the next blocks, with `deferred` of 2,048 cells at most; afterwards a
  /// keyframe may be recorded, but no evidence that was there at the beginning may be gone. What
  /// was begun has to be finished before another one begins. False once no block is left. O(images
  /// of the window). One worker calls `beside(context)` first, which must not write what this
  /// reads.
  bool step(const EvidenceWindow& window, void (*beside)(void*) = nullptr,
            void* context = nullptr) noexcept;
  /// All that is left.
  void finish(const EvidenceWindow& window) noexcept {
    while (step(window)) {
    }
  }
  /// Most steps that are left; 0 just if none is.
  [[nodiscard]] std::uint32_t steps_left() const noexcept;

  /// Blocks for which the last `store` found no room: they keep their online labels.
  [[nodiscard]] std::uint64_t not_stored() const noexcept { return not_stored_; }
  /// Blocks for which the last relabelling found no room: they keep their online labels.
  [[nodiscard]] std::uint64_t not_relabelled() const noexcept { return changed_.refused(); }

  /// What was begun last is done: there is a result. False too where nothing was to be done.
  [[nodiscard]] bool is_done() const noexcept { return progress_ == Progress::kDone; }
  /// Counts of the keyframe that was relabelled last; not available from the first step of another
  /// relabelling to its end.
  [[nodiscard]] const RelabelledKeyframe& result() const noexcept { return result_; }
  /// Changes the labels of a scan of that keyframe accordingly. Returns how many. O(points).
  std::size_t relabel(const PointView& points, const Pose& T_odometry_sensor,
                      std::span<PointLabel> labels) const noexcept;

 private:
  static constexpr std::uint32_t kGroup = 2048;

  /// The undecided cells of a block.
  struct OpenBlock {
    std::uint64_t dynamic;
    std::uint64_t open;   ///< static without enough evidence
    std::uint64_t place;  ///< see `place_of`

    /// The block in the keyframe's grid.
    [[nodiscard]] VoxelIndex index() const noexcept;
    /// Its entry in the window.
    [[nodiscard]] std::uint32_t entry() const noexcept;
  };
  struct Stored {
    std::uint32_t sequence;
    std::uint32_t keyframe;  ///< the window's number of it
    std::uint32_t first;     ///< in the ring of open blocks
    std::uint32_t count;
    std::uint32_t cells;  ///< undecided ones
    Grid grid;
  };
  /// Cells whose label changed.
  struct Changed {
    std::uint64_t now_dynamic = 0;
    std::uint64_t now_static = 0;
  };
  struct Group;

  void drop_oldest() noexcept;
  void begin_first(std::uint32_t latest) noexcept;
  /// Keyframes whose evidence counts: from `latest_age` to before `age` ago.
  struct Ages {
    std::uint32_t age;
    std::uint32_t latest_age;
  };
  void start(const BlockWindow& blocks) noexcept;
  /// The open blocks of the next slice.
  Slice next_slice() noexcept;
  /// Puts an open block into the group.
  void add(const BlockWindow& blocks, std::uint32_t block, const Ages& ages, Group& group) noexcept;
  void finish_group(const EvidenceWindow& window, const Ages& ages, Group& group) noexcept;
  /// The cells of a block whose label changes.
  [[nodiscard]] Changed change_of(const OpenBlock& block, const std::int32_t* log_odds,
                                  std::int32_t decided) const noexcept;
  void take(const OpenBlock& block) noexcept;
  [[nodiscard]] OpenBlock& ring(std::uint32_t at) noexcept { return open_[at % capacity_]; }

  [[nodiscard]] bool is_in_progress() const noexcept {
    return progress_ == Progress::kBegun || progress_ == Progress::kUnderWay;
  }

  bool on_ = false;
  std::int32_t prior_ = 0;
  std::int32_t occupied_ = 0;
  std::int32_t confirmed_static_ = 0;
  std::uint32_t stride_ = 1;  ///< of the images of each keyframe

  std::uint64_t not_stored_ = 0;
  std::uint32_t keyframe_capacity_ = 0;  ///< keyframes of the window, and the current one
  std::uint32_t capacity_ = 0;           ///< open blocks of all of them
  std::uint32_t next_ = 0;               ///< index in the ring
  OpenBlock* open_ = nullptr;
  std::uint32_t stored_ = 0;
  Stored keyframes_[RemovalConfig::kMaxWindow + 1] = {};  ///< oldest first

  /// Of relabelling the first of `keyframes_`.
  enum class Progress : std::uint8_t { kNone, kBegun, kUnderWay, kDone };
  Progress progress_ = Progress::kNone;
  std::uint32_t latest_ = 0;        ///< keyframe whose evidence is the latest used
  std::uint32_t next_block_ = 0;    ///< of its open blocks
  std::uint32_t cells_passed_ = 0;  ///< in the blocks before
  Executor executor_;
  std::uint32_t slice_cells_ = 0;
  Group* groups_ = nullptr;  ///< one for each worker
  Grid grid_;                ///< of the keyframe relabelled last
  RelabelledKeyframe result_;
  FixedHashMap<Changed> changed_;  ///< by block in that grid
};

}  // namespace unimapper::onboard
