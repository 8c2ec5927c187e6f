#include "ground.hpp"

#include <algorithm>

#include "unimapper/core/angles.hpp"

namespace unimapper::onboard {
namespace {

/// Whether the sensor was clearly below the voxel's plane: it saw a ceiling. Of ground one sees the
/// upper side, however the odometry's frame is tilted.
bool is_seen_from_below(const CoarseVoxel& voxel, const Eigen::Vector3f& sensor_m) noexcept {
  constexpr float kClear_m = 0.3F;
  const Eigen::Vector3f away_m = voxel.mean - sensor_m;
  return voxel.normal.dot(away_m) > kClear_m + kPlaneErrorPerMetre * away_m.norm();
}

bool has_points_below(const FixedHashMap<CoarseVoxel>& voxels, VoxelIndex index,
                      std::int32_t depth) noexcept {
  for (std::int32_t i = 0; i < depth; ++i) {
    --index.z;
    if (voxels.find(pack(index)) != CoarseVoxels::kNone) return true;
  }
  return false;
}

/// Adds a donor's plane to the sums of its neighbours, and its own, unless they have a plane
/// already. Visiting the few donors is cheaper than searching the neighbours of every voxel.
void add_donor(std::uint32_t donor, const Eigen::Vector3f& normal, const Eigen::Vector3f& point,
               FixedHashMap<CoarseVoxel>& voxels) noexcept {
  const VoxelIndex center = unpack(voxels.key(donor));
  for (std::int32_t n = 0; n < 27; ++n) {
    const VoxelIndex index{center.x + n % 3 - 1, center.y + n / 3 % 3 - 1, center.z + n / 9 - 1};
    const std::uint32_t neighbour = voxels.find(pack(index));
    if (neighbour == CoarseVoxels::kNone) continue;
    CoarseVoxel& voxel = voxels[neighbour];
    if (voxel.has_ground) continue;
    voxel.ground_normal += normal;
    voxel.sum += point;
    ++voxel.points;
  }
}

void average_donors(const GroundConfig& config, FixedHashMap<CoarseVoxel>& voxels) noexcept {
  for (CoarseVoxel& voxel : voxels.values()) {
    if (voxel.has_ground || voxel.points == 0) continue;
    voxel.has_ground = true;
    if (voxel.ground && config.own_plane_first) {
      voxel.ground_normal = voxel.normal;
      voxel.ground_point = voxel.mean;
      continue;
    }
    // Normals all point up, so their sum never vanishes.
    voxel.ground_normal.normalize();
    voxel.ground_point = voxel.sum / static_cast<float>(voxel.points);
  }
}

}  // namespace

std::uint32_t find_ground(float voxel_size_m, const Eigen::Vector3f& sensor_m,
                          FixedHashMap<CoarseVoxel>& voxels) noexcept {
  const auto min_up = static_cast<float>(cos_deg(GroundConfig::kMaxTiltDeg));
  const auto depth = static_cast<std::int32_t>(GroundConfig::kBelowDepthM / voxel_size_m + 0.5F);
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < voxels.size(); ++i) {
    CoarseVoxel& voxel = voxels[i];
    if (!voxel.plane || voxel.normal.z() <= min_up) continue;
    if (is_seen_from_below(voxel, sensor_m)) continue;
    if (has_points_below(voxels, unpack(voxels.key(i)), depth)) continue;
    voxel.ground = true;
    ++count;
  }
  return count;
}

void propagate_ground(const GroundConfig& config, FixedHashMap<CoarseVoxel>& voxels) noexcept {
  for (CoarseVoxel& voxel : voxels.values()) {
    voxel.sum.setZero();
    voxel.points = 0;
  }
  for (std::uint32_t i = 0; i < voxels.size(); ++i) {
    if (voxels[i].ground) add_donor(i, voxels[i].normal, voxels[i].mean, voxels);
  }
  average_donors(config, voxels);
  for (std::uint32_t step = 1; step < config.propagation_voxels; ++step) {
    for (std::uint32_t i = 0; i < voxels.size(); ++i) {
      const CoarseVoxel& voxel = voxels[i];
      // The neighbours of ground voxels have their plane.
      if (!voxel.has_ground || voxel.ground) continue;
      add_donor(i, voxel.ground_normal, voxel.ground_point, voxels);
    }
    average_donors(config, voxels);
  }
}

void split_ground(const GroundConfig& ground, const RemovalConfig& removal,
                  const CoarseVoxels& voxels, const StrayReturns& stray, Slice some,
                  CellTable& cells) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = some.first; b < some.end; ++b) {
    CellMarks marks;
    const bool may_be_stray = stray.may_be_in(blocks[b], cells.grid().cell_size_m);
    std::uint64_t left = blocks[b].occupied;
    for (std::uint32_t row = blocks[b].first; left != 0; ++row, left &= left - 1) {
      const std::uint64_t cell = lowest_bit(left);
      if (may_be_stray && cells.points(row) == 1) marks.follower |= cell;
      const std::uint32_t entry = voxels.of_row(row);
      if (entry == CoarseVoxels::kNone || !voxels.map()[entry].has_ground) {
        if (!removal.candidates_next_to_ground) marks.candidate |= cell;
        continue;
      }
      const float height = height_above_ground(voxels.map()[entry], cells.position(row));
      if (height < ground.margin_m) {
        marks.ground |= cell;
        continue;
      }
      marks.candidate |= cell;
      if (height < removal.connecting_height_m) marks.follower |= cell;
    }
    marks.follower &= marks.candidate;
    cells.marks(b) = marks;
  }
}

std::uint32_t ground_level_in_cell(const GroundConfig& config, const CoarseVoxels& voxels,
                                   const CellTable& cells, std::uint32_t row) noexcept {
  const std::uint32_t entry = voxels.of_row(row);
  if (entry == CoarseVoxels::kNone || !voxels.map()[entry].has_ground) return 0;
  return level_in_cell_above(voxels.map()[entry], config.margin_m, cells, row);
}

std::uint32_t level_in_cell_above(const CoarseVoxel& voxel, float height_m, const CellTable& cells,
                                  std::uint32_t row) noexcept {
  const float size_m = cells.grid().cell_size_m;
  // Straight below or above the cell's mean; ground normals are within theta_A of up.
  const Eigen::Vector3f p = cells.position(row);
  const float above = height_above_ground(voxel, p) - height_m;
  const float level_m = p.z() - above / voxel.ground_normal.z();
  constexpr auto kHeights = static_cast<float>(kAboveCell);
  const float level = (level_m / size_m - static_cast<float>(cells.index(row).z)) * kHeights;
  return static_cast<std::uint32_t>(std::clamp(level, 0.0F, kHeights));
}

}  // namespace unimapper::onboard
