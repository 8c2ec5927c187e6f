#include "scan_accumulator.hpp"

#include <algorithm>
#include <cmath>

namespace unimapper::onboard {

namespace {

/// Values of up to `n` points along one axis: those in sensor coordinates become those in cells,
/// and these are taken apart.
template <std::size_t n>
struct Axis {
  float value[n];         ///< metres from the sensor, then cells from the grid's origin
  std::int32_t cell[n];   ///< index of the cell
  std::int32_t block[n];  ///< index of its block
  float local[n];         ///< within the cell, [0, 1)

  void split(std::size_t size) noexcept {
    for (std::size_t i = 0; i < size; ++i) {
      cell[i] = floor_of_bounded(value[i]);
      block[i] = cell[i] >> Block::kEdgeBits;
      local[i] = value[i] - static_cast<float>(cell[i]);
    }
  }
};

}  // namespace

/// A stretch of a scan as separate arrays, so that the loops over them vectorise.
struct ScanAccumulator::Batch {
  std::size_t size = 0;
  std::int32_t valid[kBatch];  ///< 1 or 0
  Axis<kBatch> x;
  Axis<kBatch> y;
  Axis<kBatch> z;
  std::uint32_t bit[kBatch];     ///< of the cell: its number within the block
  std::uint32_t recent[kBatch];  ///< where its block would be among the recent ones
  std::uint32_t height[kBatch];  ///< within the cell, as in a code

  [[nodiscard]] VoxelIndex block(std::size_t i) const noexcept {
    return {x.block[i], y.block[i], z.block[i]};
  }
  [[nodiscard]] bool is_in(const VoxelIndex& other, std::size_t i) const noexcept {
    return x.block[i] == other.x && y.block[i] == other.y && z.block[i] == other.z;
  }
  /// Adds point `i` to its cell.
  void add_to(CellSums& cell, std::size_t i) const noexcept {
    cell.x += x.local[i];
    cell.y += y.local[i];
    cell.z += z.local[i];
    ++cell.points;
  }
};

void ScanAccumulator::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  const KeyframeConfig& keyframe = config.keyframe;
  max_points_ = keyframe.max_points_per_scan;
  range_min_squared_ = keyframe.range_min_m * keyframe.range_min_m;
  range_max_squared_ = keyframe.range_max_m * keyframe.range_max_m;
  cells_per_leaf_inverse_ = keyframe.downsample_leaf_m > 0.0F
                                ? config.voxel.fine_size_m / keyframe.downsample_leaf_m
                                : 0.0F;
  codes_ = arena.allocate<PointCode>(static_cast<std::size_t>(max_points_) * keyframe.scans);
  leaves_.allocate(arena, cells_per_leaf_inverse_ > 0.0F ? max_points_ : 0);
}

void ScanAccumulator::allocate_cells(Arena& arena, const PipelineConfig& config) noexcept {
  cells_.allocate(arena, config.voxel);
  recent_ = arena.allocate<Recent>(kRecent);
}

void ScanAccumulator::begin(const Grid& grid) noexcept {
  grid_ = grid;
  scans_ = 0;
  cells_.clear();
  constexpr VoxelIndex kBeyondEveryCell{INT32_MAX, 0, 0};
  std::fill_n(recent_, kRecent, Recent{kBeyondEveryCell, BlockWindow::kNone});
}

ScanCounts ScanAccumulator::add(const PointView& points, const Pose& T_odometry_sensor,
                                BlockWindow& window) noexcept {
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
    read(fitting, first, batch, counts);
    locate(batch);
    if (cells_per_leaf_inverse_ > 0.0F) {
      insert_thinned(batch, codes + first, counts, window);
    } else {
      insert(batch, codes + first, counts, window);
    }
  }
  if (counts.valid == 0) return counts;
  points_of_[scans_++] = static_cast<std::uint32_t>(points.count);
  return counts;
}

void ScanAccumulator::sort_out_invalid(Batch& batch, ScanCounts& counts) noexcept {
  float* const x = batch.x.value;
  float* const y = batch.y.value;
  float* const z = batch.z.value;
  for (std::size_t i = 0; i < batch.size; ++i) {
    if (batch.valid[i] != 0) continue;
    const bool finite = std::isfinite(x[i]) && std::isfinite(y[i]) && std::isfinite(z[i]);
    ++(finite ? counts.out_of_range : counts.not_finite);
    x[i] = y[i] = z[i] = 0.0F;  // converts to an integer without harm
  }
}

void ScanAccumulator::read(const PointView& points, std::size_t first, Batch& batch,
                           ScanCounts& counts) const noexcept {
  float* const x = batch.x.value;
  float* const y = batch.y.value;
  float* const z = batch.z.value;
  for (std::size_t i = 0; i < batch.size; ++i) {
    const Eigen::Vector3f p = points[first + i];
    x[i] = p.x();
    y[i] = p.y();
    z[i] = p.z();
  }
  std::int32_t valid = 0;
  for (std::size_t i = 0; i < batch.size; ++i) {
    const float squared = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
    // Both false for NaN too.
    const std::int32_t far_enough = squared >= range_min_squared_ ? 1 : 0;
    const std::int32_t near_enough = squared <= range_max_squared_ ? 1 : 0;
    batch.valid[i] = far_enough & near_enough;
    valid += batch.valid[i];
  }
  counts.valid += static_cast<std::uint64_t>(valid);
  if (static_cast<std::size_t>(valid) != batch.size) sort_out_invalid(batch, counts);
}

void ScanAccumulator::locate(Batch& batch) const noexcept {
  const Eigen::Matrix3f m = cells_from_sensor_;
  const Eigen::Vector3f t = sensor_in_cells_;
  float* const x = batch.x.value;
  float* const y = batch.y.value;
  float* const z = batch.z.value;
  for (std::size_t i = 0; i < batch.size; ++i) {
    const float px = x[i];
    const float py = y[i];
    const float pz = z[i];
    x[i] = bounded_for_int(m(0, 0) * px + m(0, 1) * py + m(0, 2) * pz + t.x());
    y[i] = bounded_for_int(m(1, 0) * px + m(1, 1) * py + m(1, 2) * pz + t.y());
    z[i] = bounded_for_int(m(2, 0) * px + m(2, 1) * py + m(2, 2) * pz + t.z());
  }
  batch.x.split(batch.size);
  batch.y.split(batch.size);
  batch.z.split(batch.size);
  for (std::size_t i = 0; i < batch.size; ++i) {
    constexpr std::int32_t kInBlock = Block::kEdge - 1;
    batch.bit[i] = static_cast<std::uint32_t>(
        (batch.x.cell[i] & kInBlock) | ((batch.y.cell[i] & kInBlock) << Block::kEdgeBits) |
        ((batch.z.cell[i] & kInBlock) << 2 * Block::kEdgeBits));
  }
  for (std::size_t i = 0; i < batch.size; ++i) {
    batch.recent[i] = Recent::slot_of(batch.block(i));
  }
  for (std::size_t i = 0; i < batch.size; ++i) {
    const auto height = static_cast<std::int32_t>(batch.z.local[i] * 256.0F);
    batch.height[i] = static_cast<std::uint32_t>(std::min(height, 255)) << 24U;
  }
}

std::uint32_t ScanAccumulator::enter(const Batch& batch, std::size_t i,
                                     BlockWindow& window) noexcept {
  const VoxelIndex block = batch.block(i);
  const std::uint32_t number = window.enter(block);
  if (number == cells_.blocks().size()) cells_.add_block(block);
  recent_[batch.recent[i]] = {block, number};
  return number;
}

std::uint32_t ScanAccumulator::block_for(const Batch& batch, std::size_t i,
                                         BlockWindow& window) noexcept {
  const Recent& recent = recent_[batch.recent[i]];
  return batch.is_in(recent.block, i) ? recent.number : enter(batch, i, window);
}

std::uint32_t ScanAccumulator::entry_for(const Batch& batch, std::size_t i,
                                         BlockWindow& window) noexcept {
  const std::uint32_t number = block_for(batch, i, window);
  if (number == BlockWindow::kNone) return CellStore::kNone;
  return cells_.find_or_insert(number, batch.bit[i]);
}

void ScanAccumulator::find_entries(const Batch& batch, std::uint32_t* entries,
                                   BlockWindow& window) noexcept {
  // From block to cell to sums, one step at a time for all points: what a step reads is then on
  // its way before it is needed.
  std::uint32_t* const numbers = entries;
  const std::size_t size = batch.size;
  for (std::size_t i = 0; i < size; ++i) {
    numbers[i] = BlockWindow::kNone;
    if (batch.valid[i] == 0) continue;
    numbers[i] = block_for(batch, i, window);
    if (numbers[i] != BlockWindow::kNone) cells_.prefetch_block(numbers[i]);
  }
  for (std::size_t i = 0; i < size; ++i) {
    if (numbers[i] == BlockWindow::kNone) continue;
    entries[i] = cells_.find_or_insert(numbers[i], batch.bit[i]);
    if (entries[i] != CellStore::kNone) cells_.prefetch_sums(entries[i]);
  }
}

void ScanAccumulator::insert(const Batch& batch, PointCode* codes, ScanCounts& counts,
                             BlockWindow& window) noexcept {
  std::uint32_t entries[kBatch];
  find_entries(batch, entries, window);
  // Points that follow each other often share their cell: its sums then stay in registers.
  CellSums none{};
  CellSums* cell = &none;
  CellSums sums{};
  std::uint32_t entry = CellStore::kNone;
  for (std::size_t i = 0; i < batch.size; ++i) {
    const std::uint32_t found = entries[i];
    if (found == CellStore::kNone) {
      codes[i] = batch.valid[i] != 0 ? kPointDropped : kPointInvalid;
      counts.no_cell += static_cast<std::uint32_t>(batch.valid[i]);
      continue;
    }
    if (found != entry) {
      *cell = sums;
      entry = found;
      cell = &cells_[found];
      sums = *cell;
    }
    batch.add_to(sums, i);
    codes[i] = found | batch.height[i];
  }
  *cell = sums;
}

void ScanAccumulator::insert_thinned(const Batch& batch, PointCode* codes, ScanCounts& counts,
                                     BlockWindow& window) noexcept {
  for (std::size_t i = 0; i < batch.size; ++i) {
    if (batch.valid[i] == 0) {
      codes[i] = kPointInvalid;
      continue;
    }
    const VoxelKey leaf = pack(voxel_index({batch.x.value[i], batch.y.value[i], batch.z.value[i]},
                                           cells_per_leaf_inverse_));
    const std::uint32_t known = leaves_.find(leaf);
    if (known != FixedHashMap<PointCode>::kNotFound) {
      codes[i] = leaves_[known];
      continue;
    }
    const std::uint32_t found = entry_for(batch, i, window);
    if (found == CellStore::kNone) {
      codes[i] = kPointDropped;
      ++counts.no_cell;
    } else {
      batch.add_to(cells_[found], i);
      codes[i] = found | batch.height[i];
    }
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
