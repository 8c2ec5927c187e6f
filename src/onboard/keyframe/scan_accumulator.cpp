#include "scan_accumulator.hpp"

#include <algorithm>
#include <cmath>

#include "src/core/prefetch.hpp"

namespace unimapper::onboard {

namespace {

/// A coordinate in cells, taken apart.
struct Coordinate {
  std::int32_t cell;
  float local;  ///< within the cell, [0, 1)

  explicit Coordinate(float in_cells) noexcept
      : cell(floor_of_bounded(in_cells)), local(in_cells - static_cast<float>(cell)) {}
  [[nodiscard]] std::int32_t block() const noexcept { return cell >> Block::kEdgeBits; }
  [[nodiscard]] std::int32_t in_block() const noexcept { return cell & (Block::kEdge - 1); }
};

/// Starts loading some points of a scan, as far as it has them.
void prefetch_points(const PointView& points, std::size_t first, std::size_t end) noexcept {
  constexpr std::size_t kCacheLine = 64;
  const std::size_t step = points.stride == 0 ? kCacheLine : 1 + (kCacheLine - 1) / points.stride;
  for (std::size_t i = first; i < std::min(end, points.count); i += step) {
    prefetch_for_read(points.data + i * points.stride);
  }
}

}  // namespace

/// A stretch of a scan as separate arrays, so that the loops over them vectorise.
struct ScanAccumulator::Batch {
  std::size_t size = 0;
  std::int32_t valid[kBatch];  ///< 1 or 0
  // In sensor coordinates, metres; then from the grid's origin, in cells.
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  std::int32_t block_x[kBatch];
  std::int32_t block_y[kBatch];
  std::int32_t block_z[kBatch];
  // Not 0: something differs from the point before.
  std::int32_t block_changed[kBatch];  ///< the block, or whether it is valid
  std::int32_t cell_changed[kBatch];   ///< the block, its validity, or the cell
  std::int32_t bit[kBatch];            ///< of the cell: its number within the block
  float local_x[kBatch];               ///< within the cell, [0, 1)
  float local_y[kBatch];
  float local_z[kBatch];
  std::uint32_t height[kBatch];  ///< within the cell, as in a code

  [[nodiscard]] VoxelIndex block(std::size_t i) const noexcept {
    return {block_x[i], block_y[i], block_z[i]};
  }
  /// Adds point `i` to its cell.
  void add_to(CellSums& cell, std::size_t i) const noexcept {
    cell.x += local_x[i];
    cell.y += local_y[i];
    cell.z += local_z[i];
    ++cell.points;
  }
};

/// Points that follow each other in one block, and in one cell of it, are looked up together.
struct ScanAccumulator::Runs {
  std::uint32_t blocks = 0;
  std::uint32_t first[kBatch];   ///< point of each block
  std::uint32_t number[kBatch];  ///< of each block, or `BlockWindow::kNone`

  std::uint32_t cells = 0;
  std::uint32_t first_of_cell[kBatch];  ///< point of each cell
  std::uint32_t block_of_cell[kBatch];  ///< its run
  std::uint32_t entry[kBatch];          ///< of each cell, or `CellStore::kNone`
  std::uint32_t cell_of_point[kBatch];  ///< its run

  /// Splits a batch; the points of a run are all valid or all invalid.
  void find(const Batch& batch) noexcept {
    blocks = cells = 0;
    for (std::uint32_t i = 0; i < batch.size; ++i) {
      first[blocks] = i;
      blocks += batch.block_changed[i] != 0 ? 1U : 0U;
      first_of_cell[cells] = i;
      block_of_cell[cells] = blocks - 1;
      cells += batch.cell_changed[i] != 0 ? 1U : 0U;
      cell_of_point[i] = cells - 1;
    }
  }
};

void ScanAccumulator::allocate(Arena& arena, const PipelineConfig& config,
                               VectorWidth width) noexcept {
  width_ = width;
  const KeyframeConfig& keyframe = config.keyframe;
  max_points_ = keyframe.max_points_per_scan;
  range_min_squared_ = keyframe.range_min_m * keyframe.range_min_m;
  range_max_squared_ = keyframe.range_max_m * keyframe.range_max_m;
  cells_per_leaf_inverse_ = keyframe.downsample_leaf_m > 0.0F
                                ? config.voxel.fine_size_m / keyframe.downsample_leaf_m
                                : 0.0F;
  codes_ = arena.allocate<PointCode>(static_cast<std::size_t>(max_points_) * keyframe.scans);
  leaves_.allocate(arena, cells_per_leaf_inverse_ > 0.0F ? max_points_ : 0);
  if (!config.intensity) return;
  intensities_ = arena.allocate<IntensitySum>(CellStore::max_entries(config.voxel));
}

void ScanAccumulator::allocate_cells(Arena& arena, const PipelineConfig& config) noexcept {
  cells_.allocate(arena, config.voxel);
  recent_ = arena.allocate<Recent>(kRecent);
}

void ScanAccumulator::begin(const Grid& grid) noexcept {
  grid_ = grid;
  scans_ = 0;
  if (intensities_ != nullptr) std::fill_n(intensities_, cells_.entries(), IntensitySum());
  cells_.clear();
  constexpr VoxelIndex kBeyondEveryCell{INT32_MAX, 0, 0};
  std::fill_n(recent_, kRecent, Recent{kBeyondEveryCell, BlockWindow::kNone});
}

bool ScanAccumulator::has_valid_point(const PointView& points) const noexcept {
  const std::size_t count = std::min<std::size_t>(points.count, max_points_);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f p = points[i];
    const float squared = p.x() * p.x() + p.y() * p.y() + p.z() * p.z();
    if (squared >= range_min_squared_ && squared <= range_max_squared_) return true;
  }
  return false;
}

void ScanAccumulator::begin_scan(const Pose& T_odometry_sensor) noexcept {
  const double per_metre = 1.0 / static_cast<double>(grid_.cell_size_m);
  cells_from_sensor_ = (T_odometry_sensor.rotation * per_metre).cast<float>();
  sensor_in_cells_ = ((T_odometry_sensor.translation - grid_.origin_m()) * per_metre).cast<float>();
  counts_ = {};
  added_ = 0;
  leaves_.clear();
}

bool ScanAccumulator::add_points(const PointView& points, std::size_t most,
                                 BlockWindow& window) noexcept {
  PointView fitting = points;
  fitting.count = std::min<std::size_t>(points.count, max_points_);
  PointCode* codes = codes_ + static_cast<std::size_t>(scans_) * max_points_;
  const std::size_t first = added_;
  const std::size_t end = fitting.count - added_ > most ? added_ + most : fitting.count;
  Batch batch;
  for (; added_ < end; added_ += batch.size) {
    batch.size = std::min(kBatch, end - added_);
    prefetch_points(fitting, added_ + kBatch, added_ + 2 * kBatch);
    read(fitting, added_, batch);
    locate(batch);
    if (cells_per_leaf_inverse_ > 0.0F) {
      insert_thinned(batch, codes + added_, window);
    } else {
      insert(batch, codes + added_, window);
    }
  }
  if (intensities_ != nullptr && points.intensities != nullptr) {
    add_intensities(points, first, end, codes);
  }
  if (added_ < fitting.count) return true;
  counts_.points = points.count;
  counts_.beyond_capacity = points.count - fitting.count;
  if (counts_.valid != 0) points_of_[scans_++] = static_cast<std::uint32_t>(points.count);
  return false;
}

void ScanAccumulator::sort_out_invalid(Batch& batch) noexcept {
  for (std::size_t i = 0; i < batch.size; ++i) {
    if (batch.valid[i] != 0) continue;
    float& x = batch.x[i];
    float& y = batch.y[i];
    float& z = batch.z[i];
    const bool finite = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
    ++(finite ? counts_.out_of_range : counts_.not_finite);
    x = y = z = 0.0F;  // converts to an integer without harm
  }
}

void ScanAccumulator::read(const PointView& points, std::size_t first, Batch& batch) noexcept {
  for (std::size_t i = 0; i < batch.size; ++i) {
    const Eigen::Vector3f p = points[first + i];
    batch.x[i] = p.x();
    batch.y[i] = p.y();
    batch.z[i] = p.z();
  }
  std::int32_t valid = 0;
  run_vectorised(width_, [&]() UNIMAPPER_VECTORISED {
    const float least = range_min_squared_;
    const float most = range_max_squared_;
    std::int32_t count = 0;
    for (std::size_t i = 0; i < batch.size; ++i) {
      const float squared =
          batch.x[i] * batch.x[i] + batch.y[i] * batch.y[i] + batch.z[i] * batch.z[i];
      // Both false for NaN too.
      const std::int32_t far_enough = squared >= least ? 1 : 0;
      const std::int32_t near_enough = squared <= most ? 1 : 0;
      batch.valid[i] = far_enough & near_enough;
      count += batch.valid[i];
    }
    valid = count;
  });
  counts_.valid += static_cast<std::uint64_t>(valid);
  if (static_cast<std::size_t>(valid) != batch.size) sort_out_invalid(batch);
}

void ScanAccumulator::locate(Batch& batch) const noexcept {
  run_vectorised(width_, [&]() UNIMAPPER_VECTORISED {
    const Eigen::Matrix3f m = cells_from_sensor_;
    const Eigen::Vector3f t = sensor_in_cells_;
    for (std::size_t i = 0; i < batch.size; ++i) {
      const float px = batch.x[i];
      const float py = batch.y[i];
      const float pz = batch.z[i];
      batch.x[i] = bounded_for_int(m(0, 0) * px + m(0, 1) * py + m(0, 2) * pz + t.x());
      batch.y[i] = bounded_for_int(m(1, 0) * px + m(1, 1) * py + m(1, 2) * pz + t.y());
      batch.z[i] = bounded_for_int(m(2, 0) * px + m(2, 1) * py + m(2, 2) * pz + t.z());
    }
    // Not in the same loop: what a bound makes of a value would become a branch of its own.
    for (std::size_t i = 0; i < batch.size; ++i) {
      const Coordinate x(batch.x[i]);
      const Coordinate y(batch.y[i]);
      const Coordinate z(batch.z[i]);
      batch.block_x[i] = x.block();
      batch.block_y[i] = y.block();
      batch.block_z[i] = z.block();
      batch.bit[i] = x.in_block() | (y.in_block() << Block::kEdgeBits) |
                     (z.in_block() << 2 * Block::kEdgeBits);
      batch.local_x[i] = x.local;
      batch.local_y[i] = y.local;
      batch.local_z[i] = z.local;
      const auto height = static_cast<std::int32_t>(z.local * 256.0F);
      batch.height[i] = static_cast<std::uint32_t>(height < 255 ? height : 255) << 24U;
    }
    batch.block_changed[0] = batch.cell_changed[0] = 1;
    for (std::size_t i = 1; i < batch.size; ++i) {
      const std::int32_t block =
          (batch.block_x[i] ^ batch.block_x[i - 1]) | (batch.block_y[i] ^ batch.block_y[i - 1]) |
          (batch.block_z[i] ^ batch.block_z[i - 1]) | (batch.valid[i] ^ batch.valid[i - 1]);
      batch.block_changed[i] = block;
      batch.cell_changed[i] = block | (batch.bit[i] ^ batch.bit[i - 1]);
    }
  });
}

std::uint32_t ScanAccumulator::enter(const VoxelIndex& block, BlockWindow& window) noexcept {
  const std::uint32_t number = window.enter(block);
  if (number == cells_.block_count()) cells_.add_block(block);
  return number;
}

std::uint32_t ScanAccumulator::entry_for(const Batch& batch, std::size_t i,
                                         BlockWindow& window) noexcept {
  const VoxelIndex block = batch.block(i);
  Recent& recent = recent_[Recent::slot_of(block)];
  if (recent.block != block) recent = {block, enter(block, window)};
  if (recent.number == BlockWindow::kNone) return CellStore::kNone;
  return cells_.find_or_insert(recent.number, static_cast<std::uint32_t>(batch.bit[i]));
}

void ScanAccumulator::find_blocks(const Batch& batch, Runs& runs, BlockWindow& window) noexcept {
  // A block that is not among the recent ones becomes one at once, with the number of its run in
  // place of its own; it is looked up with all others of the batch, one step of the way at a time:
  // what a step reads is then on its way before it is needed.
  constexpr std::uint32_t kRunNumber = 0xFFFF0000U;  // added to a run's number; above all blocks'
  std::uint32_t missing[kBatch];
  std::uint32_t missing_count = 0;
  for (std::uint32_t r = 0; r < runs.blocks; ++r) {
    runs.number[r] = BlockWindow::kNone;
    if (batch.valid[runs.first[r]] == 0) continue;
    const VoxelIndex block = batch.block(runs.first[r]);
    Recent& recent = recent_[Recent::slot_of(block)];
    if (recent.block != block) {
      recent = {block, kRunNumber + r};
      missing[missing_count++] = r;
      window.prefetch_directory(block);
    }
    runs.number[r] = recent.number;
  }
  std::uint32_t tiles[kBatch];
  for (std::uint32_t m = 0; m < missing_count; ++m) {
    tiles[m] = window.prefetch_tile(batch.block(runs.first[missing[m]]));
  }
  for (std::uint32_t m = 0; m < missing_count; ++m) {
    window.prefetch_number(tiles[m], batch.block(runs.first[missing[m]]));
  }
  for (std::uint32_t m = 0; m < missing_count; ++m) {
    const std::uint32_t r = missing[m];
    const VoxelIndex block = batch.block(runs.first[r]);
    runs.number[r] = enter(block, window);
    // Another block may have taken its place.
    Recent& recent = recent_[Recent::slot_of(block)];
    if (recent.number == kRunNumber + r) recent.number = runs.number[r];
  }
  for (std::uint32_t r = 0; r < runs.blocks; ++r) {
    std::uint32_t& number = runs.number[r];
    if (number - kRunNumber < kBatch) number = runs.number[number - kRunNumber];
    if (number != BlockWindow::kNone) cells_.prefetch_block(number);
  }
}

void ScanAccumulator::find_entries(const Batch& batch, Runs& runs) noexcept {
  for (std::uint32_t c = 0; c < runs.cells; ++c) {
    const std::uint32_t number = runs.number[runs.block_of_cell[c]];
    runs.entry[c] = CellStore::kNone;
    if (number == BlockWindow::kNone) continue;
    const auto bit = static_cast<std::uint32_t>(batch.bit[runs.first_of_cell[c]]);
    runs.entry[c] = cells_.find_or_insert(number, bit);
    if (runs.entry[c] != CellStore::kNone) cells_.prefetch_sums(runs.entry[c]);
  }
}

void ScanAccumulator::insert(const Batch& batch, PointCode* codes, BlockWindow& window) noexcept {
  Runs runs;
  runs.find(batch);
  counts_.runs += runs.cells;
  find_blocks(batch, runs, window);
  find_entries(batch, runs);
  // The sums of a cell stay in registers during its run.
  CellSums none{};
  CellSums* cell = &none;
  CellSums sums{};
  std::uint32_t entry = CellStore::kNone;
  for (std::size_t i = 0; i < batch.size; ++i) {
    const std::uint32_t found = runs.entry[runs.cell_of_point[i]];
    if (found == CellStore::kNone) {
      codes[i] = batch.valid[i] != 0 ? kPointDropped : kPointInvalid;
      counts_.no_cell += static_cast<std::uint32_t>(batch.valid[i]);
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

void ScanAccumulator::insert_thinned(const Batch& batch, PointCode* codes,
                                     BlockWindow& window) noexcept {
  counts_.runs += batch.size;
  for (std::size_t i = 0; i < batch.size; ++i) {
    if (batch.valid[i] == 0) {
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
    const std::uint32_t found = entry_for(batch, i, window);
    if (found == CellStore::kNone) {
      codes[i] = kPointDropped;
      ++counts_.no_cell;
    } else {
      batch.add_to(cells_[found], i);
      codes[i] = found | batch.height[i];
    }
    const std::uint32_t entry = leaves_.find_or_insert(leaf);
    if (entry != FixedHashMap<PointCode>::kNotFound) leaves_[entry] = codes[i];
  }
}

void ScanAccumulator::add_intensities(const PointView& points, std::size_t first, std::size_t end,
                                      const PointCode* codes) noexcept {
  for (std::size_t i = first; i < end; ++i) {
    if (!has_cell(codes[i])) continue;
    intensities_[cell_of(codes[i])].add(points.intensities[i * points.intensity_stride]);
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
