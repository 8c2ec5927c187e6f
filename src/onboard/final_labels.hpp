// Decisions taken back, or made, before a keyframe leaves the window.
#pragma once

#include <cstdint>
#include <span>

#include "cell_table.hpp"
#include "evidence.hpp"
#include "image_judge.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_hash_map.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::onboard {

/// Remembers which cells of a keyframe were called dynamic and which were called static for want of
/// evidence, and decides about them once more when the keyframe is the oldest of the window: by
/// what the keyframes after it saw through and met there (the paper's correction of erroneous
/// judgements). Cells that were firmly static, and ground, are not looked at again. The undecided
/// cells of a block are decided together.
class FinalLabels {
 public:
  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// Forgets all keyframes.
  void forget() noexcept { remembered_ = open_count_ = 0; }

  /// Remembers what was decided about the current keyframe, number `sequence`, before the window
  /// records it. If there is no room the oldest keyframes are given up. O(blocks).
  void remember(const BlockWindow& blocks, const CellTable& cells, std::uint32_t sequence) noexcept;

  /// Decides again about the keyframe that leaves the window with the next record, if there is one
  /// and it was remembered. O(undecided cells x images of the window).
  bool revise_leaving(const EvidenceWindow& window, const ImageProjection& projection) noexcept;
  /// The same for the oldest keyframe there is, after the last record. False if there is none.
  bool revise_oldest(const EvidenceWindow& window, const ImageProjection& projection) noexcept;

  /// Blocks for whose revision the last `remember` and revision found no room: they keep what was
  /// decided online.
  [[nodiscard]] std::uint64_t given_up() const noexcept { return given_up_ + changed_.refused(); }

  /// What became of the keyframe that was relabelled last.
  [[nodiscard]] const RelabelledKeyframe& result() const noexcept { return result_; }
  /// Changes the labels of a scan of that keyframe accordingly. Returns how many. O(points).
  std::size_t relabel(const PointView& points, const Pose& T_odometry_sensor,
                      std::span<PointLabel> labels) const noexcept;

 private:
  static constexpr std::uint32_t kGroup = 2048;
  static constexpr std::uint32_t kNoKeyframe = 0xFFFFFFFFU;

  /// What is not settled about the cells of a block.
  struct OpenBlock {
    std::uint64_t dynamic;
    std::uint64_t open;   ///< static for want of evidence
    std::uint32_t entry;  ///< in the window
  };
  struct Remembered {
    std::uint32_t sequence;
    std::uint32_t keyframe;  ///< the window's number of it
    std::uint32_t first;     ///< in the ring of open blocks
    std::uint32_t count;
    Grid grid;
  };
  /// Cells that changed their mind.
  struct Changed {
    std::uint64_t now_dynamic = 0;
    std::uint64_t now_static = 0;
  };
  struct Group;

  void drop_oldest() noexcept;
  bool revise(const EvidenceWindow& window, const ImageProjection& projection,
              std::uint32_t latest_age) noexcept;
  void add(const BlockWindow& blocks, const OpenBlock& block, const VoxelIndex& index,
           std::uint32_t age, std::uint32_t latest_age) noexcept;
  void settle(const EvidenceWindow& window, const ImageProjection& projection, std::uint32_t age,
              std::uint32_t latest_age) noexcept;
  void settle_block(const OpenBlock& block, const VoxelIndex& index, const std::int32_t* log_odds,
                    std::int32_t settled) noexcept;
  [[nodiscard]] OpenBlock& ring(std::uint32_t at) noexcept { return open_[at % capacity_]; }

  bool on_ = false;
  ImageJudge judge_;
  std::int32_t prior_ = 0;
  std::int32_t occupied_ = 0;
  std::int32_t firm_ = 0;
  std::uint32_t stride_ = 1;  ///< of the images of each keyframe

  std::uint64_t given_up_ = 0;
  std::uint32_t capacity_ = 0;
  std::uint32_t open_count_ = 0;
  std::uint32_t next_ = 0;  ///< place in the ring
  OpenBlock* open_ = nullptr;
  std::uint32_t remembered_ = 0;
  Remembered keyframes_[RemovalConfig::kMaxWindow + 1] = {};  ///< oldest first

  Group* group_ = nullptr;
  Grid grid_;  ///< of the keyframe relabelled last
  RelabelledKeyframe result_;
  FixedHashMap<Changed> changed_;  ///< by block in that grid
};

}  // namespace unimapper::onboard
