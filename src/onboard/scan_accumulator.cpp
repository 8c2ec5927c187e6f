#include "scan_accumulator.hpp"

#include <algorithm>
#include <cmath>

namespace unimapper::onboard {

/// Valid points of a stretch of a scan, in cell units, as separate arrays so that the transform
/// vectorises.
struct ScanAccumulator::Batch {
  std::size_t size = 0;
  bool valid[kBatch];
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  VoxelKey key[kBatch];
  float local_x[kBatch];
  float local_y[kBatch];
  float local_z[kBatch];
};

void ScanAccumulator::attach(Arena& arena, const PipelineConfig& config) noexcept {
  const KeyframeConfig& keyframe = config.keyframe;
  max_points_ = keyframe.max_points_per_scan;
  range_min_squared_ = keyframe.range_min_m * keyframe.range_min_m;
  range_max_squared_ = keyframe.range_max_m * keyframe.range_max_m;
  cells_per_leaf_inverse_ = keyframe.downsample_leaf_m > 0.0F
                                ? config.voxel.fine_size_m / keyframe.downsample_leaf_m
                                : 0.0F;
  codes_ = arena.allocate<PointCode>(static_cast<std::size_t>(max_points_) * keyframe.scans);
  cells_.attach(arena, config.voxel.max_cells);
  leaves_.attach(arena, cells_per_leaf_inverse_ > 0.0F ? max_points_ : 0);
}

void ScanAccumulator::begin(const Grid& grid) noexcept {
  grid_ = grid;
  scans_ = 0;
  cells_.clear();
}

ScanCounts ScanAccumulator::add(const PointView& points, const Pose& T_odometry_sensor) noexcept {
  const double per_metre = 1.0 / static_cast<double>(grid_.cell_size_m);
  cells_from_sensor_ = (T_odometry_sensor.rotation * per_metre).cast<float>();
  sensor_in_cells_ = ((T_odometry_sensor.translation - grid_.origin_m()) * per_metre).cast<float>();

  ScanCounts counts;
  counts.points = points.count;
  PointView fitting = points;
  fitting.count = std::min<std::size_t>(points.count, max_points_);
  counts.beyond_capacity = points.count - fitting.count;

  PointCode* codes = codes_ + static_cast<std::size_t>(scans_) * max_points_;
  leaves_.clear();
  Batch batch;
  for (std::size_t first = 0; first < fitting.count; first += kBatch) {
    batch.size = std::min(kBatch, fitting.count - first);
    locate(fitting, first, batch, counts);
    if (cells_per_leaf_inverse_ > 0.0F) {
      insert_thinned(batch, codes + first, counts);
    } else {
      insert(batch, codes + first, counts);
    }
  }
  if (counts.valid == 0) return counts;
  points_of_[scans_++] = static_cast<std::uint32_t>(points.count);
  return counts;
}

void ScanAccumulator::locate(const PointView& points, std::size_t first, Batch& batch,
                             ScanCounts& counts) const noexcept {
  for (std::size_t i = 0; i < batch.size; ++i) {
    const Eigen::Vector3f p = points[first + i];
    batch.x[i] = p.x();
    batch.y[i] = p.y();
    batch.z[i] = p.z();
  }
  std::size_t valid = 0;
  for (std::size_t i = 0; i < batch.size; ++i) {
    const float squared =
        batch.x[i] * batch.x[i] + batch.y[i] * batch.y[i] + batch.z[i] * batch.z[i];
    // False for NaN too.
    const bool in_range = squared >= range_min_squared_ && squared <= range_max_squared_;
    batch.valid[i] = in_range;
    valid += in_range ? 1U : 0U;
  }
  counts.valid += valid;
  if (valid != batch.size) {
    for (std::size_t i = 0; i < batch.size; ++i) {
      if (batch.valid[i]) continue;
      const bool finite =
          std::isfinite(batch.x[i]) && std::isfinite(batch.y[i]) && std::isfinite(batch.z[i]);
      ++(finite ? counts.out_of_range : counts.not_finite);
      batch.x[i] = batch.y[i] = batch.z[i] = 0.0F;  // converts to an integer without harm
    }
  }
  const Eigen::Matrix3f m = cells_from_sensor_;
  const Eigen::Vector3f t = sensor_in_cells_;
  for (std::size_t i = 0; i < batch.size; ++i) {
    const float px = batch.x[i];
    const float py = batch.y[i];
    const float pz = batch.z[i];
    const float x = m(0, 0) * px + m(0, 1) * py + m(0, 2) * pz + t.x();
    const float y = m(1, 0) * px + m(1, 1) * py + m(1, 2) * pz + t.y();
    const float z = m(2, 0) * px + m(2, 1) * py + m(2, 2) * pz + t.z();
    const VoxelIndex index{floor_to_int(x), floor_to_int(y), floor_to_int(z)};
    batch.x[i] = x;
    batch.y[i] = y;
    batch.z[i] = z;
    batch.key[i] = pack(index);
    batch.local_x[i] = x - static_cast<float>(index.x);
    batch.local_y[i] = y - static_cast<float>(index.y);
    batch.local_z[i] = z - static_cast<float>(index.z);
  }
}

PointCode ScanAccumulator::insert_point(const Batch& batch, std::size_t i,
                                        ScanCounts& counts) noexcept {
  const std::uint32_t entry = cells_.find_or_insert(batch.key[i]);
  if (entry == FixedHashMap<CellSums>::kNotFound) {
    ++counts.no_cell;
    return kPointDropped;
  }
  CellSums& cell = cells_[entry];
  cell.x += batch.local_x[i];
  cell.y += batch.local_y[i];
  cell.z += batch.local_z[i];
  ++cell.points;
  const auto height = static_cast<std::uint32_t>(batch.local_z[i] * 256.0F);
  return entry | (std::min(height, 255U) << 24U);
}

void ScanAccumulator::insert(const Batch& batch, PointCode* codes, ScanCounts& counts) noexcept {
  constexpr std::size_t kAhead = 12;
  for (std::size_t i = 0; i < batch.size; ++i) {
    if (i + kAhead < batch.size) cells_.prefetch(batch.key[i + kAhead]);
    codes[i] = batch.valid[i] ? insert_point(batch, i, counts) : kPointInvalid;
  }
}

void ScanAccumulator::insert_thinned(const Batch& batch, PointCode* codes,
                                     ScanCounts& counts) noexcept {
  for (std::size_t i = 0; i < batch.size; ++i) {
    if (!batch.valid[i]) {
      codes[i] = kPointInvalid;
      continue;
    }
    const VoxelKey leaf =
        pack(voxel_index({batch.x[i], batch.y[i], batch.z[i]}, cells_per_leaf_inverse_));
    const std::uint32_t known = leaves_.find(leaf);
    if (known != FixedHashMap<PointCode>::kNotFound) {
      codes[i] = leaves_[known];
      continue;
    }
    codes[i] = insert_point(batch, i, counts);
    const std::uint32_t entry = leaves_.find_or_insert(leaf);
    if (entry != FixedHashMap<PointCode>::kNotFound) leaves_[entry] = codes[i];
  }
}

std::span<const PointCode> ScanAccumulator::codes(std::uint32_t scan) const noexcept {
  if (scan >= scans_) return {};
  return {codes_ + static_cast<std::size_t>(scan) * max_points_,
          std::min(points_of_[scan], max_points_)};
}

std::size_t ScanAccumulator::largest_scan() const noexcept {
  std::uint32_t largest = 0;
  for (std::uint32_t i = 0; i < scans_; ++i) largest = std::max(largest, points_of_[i]);
  return largest;
}

}  // namespace unimapper::onboard
