// Final labels of keyframes evicted from the window
#pragma once

#include <cstdint>
#include <span>

#include "cell_table.hpp"
#include "evidence_window.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_hash_map.hpp"
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

  /// Forgets all keyframes.
  void forget() noexcept { stored_ = open_count_ = 0; }

  /// Stores the undecided cells of the current keyframe, number `sequence`, before the window
  /// records it. If there is no room the oldest keyframes are dropped. O(blocks).
  void store(const BlockWindow& blocks, const CellTable& cells, std::uint32_t sequence) noexcept;

  /// Relabels the keyframe that the next record evicts from the window, if there is one and it is
  /// stored. O(undecided cells x images of the window).
  bool relabel_evicted(const EvidenceWindow& window) noexcept;
  /// The same for the oldest keyframe there is, after the last record. False if there is none.
  bool relabel_oldest(const EvidenceWindow& window) noexcept;

  /// Blocks for which the last `store` and relabelling found no room: they keep their online
  /// labels.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_ + changed_.refused(); }

  /// Counts of the keyframe that was relabelled last.
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
    std::uint32_t entry;  ///< in the window
  };
  struct Stored {
    std::uint32_t sequence;
    std::uint32_t keyframe;  ///< the window's number of it
    std::uint32_t first;     ///< in the ring of open blocks
    std::uint32_t count;
    Grid grid;
  };
  /// Cells whose label changed.
  struct Changed {
    std::uint64_t now_dynamic = 0;
    std::uint64_t now_static = 0;
  };
  struct Group;

  void drop_oldest() noexcept;
  bool relabel_first(const EvidenceWindow& window, std::uint32_t latest_age) noexcept;
  void add(const BlockWindow& blocks, const OpenBlock& block, const VoxelIndex& index,
           std::uint32_t age, std::uint32_t latest_age) noexcept;
  void finish(const EvidenceWindow& window, std::uint32_t age, std::uint32_t latest_age) noexcept;
  void finish_block(const OpenBlock& block, const VoxelIndex& index, const std::int32_t* log_odds,
                    std::int32_t decided) noexcept;
  [[nodiscard]] OpenBlock& ring(std::uint32_t at) noexcept { return open_[at % capacity_]; }

  bool on_ = false;
  std::int32_t prior_ = 0;
  std::int32_t occupied_ = 0;
  std::int32_t confirmed_static_ = 0;
  std::uint32_t stride_ = 1;  ///< of the images of each keyframe

  std::uint64_t left_out_ = 0;
  std::uint32_t capacity_ = 0;
  std::uint32_t open_count_ = 0;
  std::uint32_t next_ = 0;  ///< index in the ring
  OpenBlock* open_ = nullptr;
  std::uint32_t stored_ = 0;
  Stored keyframes_[RemovalConfig::kMaxWindow + 1] = {};  ///< oldest first

  Group* group_ = nullptr;
  Grid grid_;  ///< of the keyframe relabelled last
  RelabelledKeyframe result_;
  FixedHashMap<Changed> changed_;  ///< by block in that grid
};

}  // namespace unimapper::onboard
