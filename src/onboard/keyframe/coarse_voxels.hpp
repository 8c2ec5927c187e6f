// Coarse voxels with mean, covariance and plane
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "cell_table.hpp"
#include "src/core/fixed_hash_map.hpp"
#include "src/core/recent_voxels.hpp"
#include "src/onboard/slice.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// The points of one coarse voxel, and the ground in or near it.
struct CoarseVoxel {
  // Raw moments about the voxel's lower corner, metres.
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();  ///< upper triangle only
  float weight = 0.0F;                                ///< of all cells
  std::uint32_t points = 0;

  Eigen::Vector3f mean = Eigen::Vector3f::Zero();    ///< metres from the grid's origin
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, z >= 0; only of planes
  float flatness = 0.0F;  ///< smallest eigenvalue per middle one; only of planes
  bool plane = false;
  bool ground = false;    ///< in G: a ground plane of its own
  bool elevated = false;  ///< a ground plane, but a step above the ground around it
  bool moving = false;    ///< holds a dynamic cell; known after the labels

  /// The plane that splits the voxel's points into ground and others: lower than the margin
  /// above it is ground. Only if the voxel is in G or next to it (`has_ground`).
  bool has_ground = false;
  Eigen::Vector3f ground_normal = Eigen::Vector3f::Zero();
  Eigen::Vector3f ground_point = Eigen::Vector3f::Zero();
};

/// How much a voxel's plane may be off for every metre that it is continued: two degrees.
inline constexpr float kPlaneErrorPerMetre = 0.035F;

/// All coarse voxels of a keyframe (paper section IV-A, equations 1 and 2). Moments come from
/// the means of the fine cells: the scatter within a 0.2 m cell is left out, which changes the
/// smallest eigenvalue of a plane by less than 0.0034 m^2. A cell weighs the square of its points,
/// so that snow, a point here and there, does not hide the ground below it (docs/design/ground.md).
class CoarseVoxels {
 public:
  void allocate(Arena& arena, const VoxelConfig& config) noexcept;

  /// Begins the voxels of a keyframe. Nothing of the one before is read. O(voxels).
  void begin() noexcept;
  /// Adds the cells of some blocks of `cells`, each block once, in their order. O(cells).
  void add(const CellTable& cells, Slice blocks, const Executor& executor = {}) noexcept;
  /// Fits the planes of some voxels, once all cells are added. O(voxels).
  void find_planes(const Grid& grid, Slice voxels) noexcept;

  static constexpr std::uint32_t kNone = FixedHashMap<CoarseVoxel>::kNotFound;
  /// Voxel of a cell by its row, or `kNone` if there was no room.
  [[nodiscard]] std::uint32_t of_row(std::uint32_t row) const noexcept { return of_row_[row]; }
  /// Cells without voxel in the last `build`.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

  [[nodiscard]] FixedHashMap<CoarseVoxel>& map() noexcept { return map_; }
  [[nodiscard]] const FixedHashMap<CoarseVoxel>& map() const noexcept { return map_; }

 private:
  /// Calls `take(block, some, voxel)` for the cells of each block, those in one voxel at a time.
  template <typename Take>
  static void split_by_voxel(const CellTable& cells, Slice blocks, const Take& take) noexcept;
  void enter(const CellTable& cells, Slice blocks, RecentVoxels& recent) noexcept;
  void add_up(const CellTable& cells, Slice blocks) noexcept;
  /// Entry of the voxel that some cells lie in.
  std::uint32_t find(std::uint64_t some, const VoxelIndex& index, RecentVoxels& recent) noexcept;
  /// Notes it for some cells of a block.
  void note_cells(const Block& block, std::uint64_t some, std::uint32_t entry) noexcept;
  /// Adds some cells of a block to their voxel.
  template <bool kNotes>
  void add_cells(const CellTable& cells, const Block& block, std::uint64_t some,
                 std::uint32_t entry, const VoxelIndex& index) noexcept;
  void find_plane(CoarseVoxel& voxel, const Eigen::Vector3f& corner) const noexcept;

  VoxelConfig config_;
  std::uint64_t left_out_ = 0;
  FixedHashMap<CoarseVoxel> map_;
  std::uint32_t* of_row_ = nullptr;
};

}  // namespace unimapper::onboard
