// Accumulation of scans into fine cells
#pragma once

#include <cstdint>
#include <span>

#include "cell_store.hpp"
#include "grid.hpp"
#include "src/core/fixed_hash_map.hpp"
#include "src/core/intensity_sum.hpp"
#include "src/onboard/removal/block_window.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/core/vector_width.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Where a point of a scan went: its entry in the lower 24 bits, and in the upper 8 how high in
/// the cell it lies, so that ground and obstacle points of one cell can be told apart later.
using PointCode = std::uint32_t;
inline constexpr PointCode kPointInvalid = 0xFFFFFFFFU;  ///< not finite or out of range
inline constexpr PointCode kPointDropped = 0xFFFFFFFEU;  ///< no room
[[nodiscard]] constexpr std::uint32_t cell_of(PointCode code) noexcept { return code & 0xFFFFFFU; }
[[nodiscard]] constexpr std::uint32_t height_of(PointCode code) noexcept { return code >> 24U; }
/// Both special codes name a cell beyond every capacity.
[[nodiscard]] constexpr bool has_cell(PointCode code) noexcept { return code < kPointDropped; }

/// Counts of the points of one scan.
struct ScanCounts {
  std::uint64_t points = 0;
  std::uint64_t valid = 0;
  std::uint64_t not_finite = 0;
  std::uint64_t out_of_range = 0;
  std::uint64_t beyond_capacity = 0;  ///< more points than fit one scan
  std::uint64_t no_cell = 0;          ///< no room for its cell or its block
  std::uint64_t runs = 0;             ///< of points that follow each other in one cell
};

/// Accumulates the scans of a keyframe (paper section IV-A). Blocks are entered into the window
/// with their first point, so the history of a cell need not be looked up again; points that follow
/// each other mostly share their block, and only a change of block is looked up.
class ScanAccumulator {
 public:
  void allocate(Arena& arena, const PipelineConfig& config,
                VectorWidth width = widest_vectors()) noexcept;
  /// The part of it that is in use from the first scan of a keyframe until its cells are laid out
  /// in a table: the cells, and what finds them.
  void allocate_cells(Arena& arena, const PipelineConfig& config) noexcept;

  /// Forgets all scans and counts cells in `grid` from now on.
  void begin(const Grid& grid) noexcept;

  /// Whether a scan has a valid point. O(points up to the first valid one).
  [[nodiscard]] bool has_valid_point(const PointView& points) const noexcept;

  /// Begins a scan, at most `KeyframeConfig::scans` times between two `begin`. One without a valid
  /// point adds nothing.
  void begin_scan(const Pose& T_odometry_sensor) noexcept;
  /// Adds its next points, `most` of them (a multiple of 256) or what is left. False once none is
  /// left: the scan is complete. `window` has begun the same keyframe and nothing else enters
  /// blocks. O(most).
  bool add_points(const PointView& points, std::size_t most, BlockWindow& window) noexcept;
  /// The points of the last scan that was begun, as far as they were added, and how many those are.
  [[nodiscard]] const ScanCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::size_t added() const noexcept { return added_; }

  [[nodiscard]] const Grid& grid() const noexcept { return grid_; }
  [[nodiscard]] std::uint32_t scans() const noexcept { return scans_; }
  [[nodiscard]] const CellStore& cells() const noexcept { return cells_; }

  /// Codes of the points of a scan in input order; points beyond the capacity have none.
  [[nodiscard]] std::span<const PointCode> codes(std::uint32_t scan) const noexcept;
  /// Points handed over in a scan, with or without code.
  [[nodiscard]] std::size_t points_of(std::uint32_t scan) const noexcept {
    return points_of_[scan];
  }
  /// Mean intensity of the points of a cell, by its entry; null without
  /// `PipelineConfig::intensity`. Until the next `begin`.
  [[nodiscard]] const IntensitySum* intensities() const noexcept { return intensities_; }
  /// Most points any scan since `begin` had.
  [[nodiscard]] std::size_t largest_scan() const noexcept;

 private:
  static constexpr std::size_t kBatch = 256;
  struct Batch;
  struct Runs;

  /// Reads up to `kBatch` points from `first` on and sorts out the invalid ones.
  void read(const PointView& points, std::size_t first, Batch& batch) noexcept;
  /// Transforms the points into cells.
  void locate(Batch& batch) const noexcept;
  void sort_out_invalid(Batch& batch) noexcept;
  void insert(const Batch& batch, PointCode* codes, BlockWindow& window) noexcept;
  /// Adds the intensities of points from `first` to `end`, which were added to their cells.
  void add_intensities(const PointView& points, std::size_t first, std::size_t end,
                       const PointCode* codes) noexcept;
  void insert_thinned(const Batch& batch, PointCode* codes, BlockWindow& window) noexcept;
  /// Entry of the cell of point `i`, or `CellStore::kNone` if it finds no room.
  std::uint32_t entry_for(const Batch& batch, std::size_t i, BlockWindow& window) noexcept;
  /// Finds the blocks of all runs of a batch.
  void find_blocks(const Batch& batch, Runs& runs, BlockWindow& window) noexcept;
  /// Finds the cells of all runs of a batch, after their blocks.
  void find_entries(const Batch& batch, Runs& runs) noexcept;
  /// Number of a block, which is made if need be, or `BlockWindow::kNone`.
  std::uint32_t enter(const VoxelIndex& block, BlockWindow& window) noexcept;

  VectorWidth width_ = VectorWidth::kBaseline;
  Grid grid_;
  float range_min_squared_ = 0.0F;
  float range_max_squared_ = 0.0F;
  float cells_per_leaf_inverse_ = 0.0F;  ///< 0: no down-sampling
  std::uint32_t max_points_ = 0;
  std::uint32_t scans_ = 0;
  std::uint32_t points_of_[KeyframeConfig::kMaxScans] = {};
  std::size_t added_ = 0;

  ScanCounts counts_;
  Eigen::Matrix3f cells_from_sensor_ = Eigen::Matrix3f::Identity();  ///< scale included
  Eigen::Vector3f sensor_in_cells_ = Eigen::Vector3f::Zero();
  PointCode* codes_ = nullptr;
  CellStore cells_;
  IntensitySum* intensities_ = nullptr;  ///< by entry, or null

  /// Recent blocks: scans return to the same ones again and again.
  static constexpr std::uint32_t kRecentBits = 11;
  static constexpr std::uint32_t kRecent = 1U << kRecentBits;
  struct Recent {
    VoxelIndex block;
    std::uint32_t number;

    /// Where a block is looked for.
    [[nodiscard]] static std::uint32_t slot_of(const VoxelIndex& block) noexcept {
      const auto x = static_cast<std::uint32_t>(block.x);
      const auto y = static_cast<std::uint32_t>(block.y);
      const auto z = static_cast<std::uint32_t>(block.z);
      return (x + (y << 5U) + (z << 2U) + (z << 9U)) % kRecent;
    }
  };
  Recent* recent_ = nullptr;  ///< `kRecent`
  FixedHashMap<PointCode> leaves_;
};

}  // namespace unimapper::onboard
