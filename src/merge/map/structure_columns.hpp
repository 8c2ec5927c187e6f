// Static structure of a merged map by the columns of a horizontal grid
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "src/merge/voxel_table.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// Heights of all sessions' static cells after refinement, by column, from low to high: one mean
/// per voxel of 0.1 m height. The grid reaches as far as ground was seen.
class StructureColumns {
 public:
  /// What is at one height of a column.
  struct Entry {
    float z_m;    ///< map frame
    bool ground;  ///< most of its cells are ground
  };

  /// Of the sessions in the map. Throws std::runtime_error for more than 2^28 columns. O(n log n)
  /// in the cells.
  StructureColumns(const std::vector<SessionData>& sessions, const MergeResult& result,
                   double resolution_m);

  /// Columns along x.
  [[nodiscard]] std::uint32_t width() const { return width_; }
  /// Columns along y.
  [[nodiscard]] std::uint32_t height() const { return height_; }
  /// Lower left corner of column 0, map frame, metres.
  [[nodiscard]] Eigen::Vector2d origin() const {
    return resolution_m_ * Eigen::Vector2d(low_.x(), low_.y());
  }
  /// The column of a point, numbered row by row; none outside of the grid.
  [[nodiscard]] std::optional<std::size_t> column(const Eigen::Vector3d& p) const;

  /// Number of entries of all columns.
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] const Entry& entry(std::size_t number) const { return entries_[number]; }
  /// Where the entries of a column begin.
  [[nodiscard]] std::size_t begin(std::size_t column) const { return first_[column]; }
  [[nodiscard]] std::size_t end(std::size_t column) const { return first_[column + 1]; }

 private:
  struct Voxel {
    float sum_z_m = 0.0F;  ///< above the voxel's lower face
    std::uint32_t cells = 0;
    std::uint32_t ground = 0;
    [[nodiscard]] bool is_ground() const { return 2 * ground > cells; }
  };

  void add(const SessionData& session, const MergedSession& merged);
  void measure();
  void sort();

  double resolution_m_;
  Eigen::Vector2i low_ = Eigen::Vector2i::Zero();
  std::uint32_t width_ = 0;
  std::uint32_t height_ = 0;
  VoxelTable table_;
  std::vector<Voxel> voxels_;
  std::vector<std::size_t> first_;  ///< by column: where its entries begin
  std::vector<Entry> entries_;
};

}  // namespace unimapper::merge
