// Scoring by the protocol of DynamicMap_Benchmark.
//
// The search is inverted: instead of searching the whole static map for every ground-truth point,
// the kept points are streamed past the few removed ones.
#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "dynamic.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper::evaluate {
namespace {

struct RemovedPoint {
  VoxelKey cell = 0;
  Eigen::Vector3f position;  // world, relative to the first scan's sensor
  float range_m = 0.0F;
  std::uint32_t truth = 0;
};

/// Removed points in cells twice the neighbour distance wide, so that the ball around a kept
/// point touches at most eight cells.
class RemovedGrid {
 public:
  explicit RemovedGrid(float neighbour_m)
      : neighbour_m_(neighbour_m), inverse_size_(0.5F / neighbour_m), near_(kNearBits / 64) {}

  void clear() {
    points_.clear();
    cells_.clear();
    std::fill(near_.begin(), near_.end(), 0);
  }
  void add(RemovedPoint point) {
    point.cell = cell_at(point.position, inverse_size_);
    points_.push_back(point);
  }
  [[nodiscard]] std::size_t size() const { return points_.size(); }

  /// Builds the cells once all points are in.
  void finish();

  /// Marks every removed point within the neighbour distance of `kept` as kept.
  void mark_kept(const Eigen::Vector3f& kept);

  /// Calls `visit(point, still_removed)` for every point.
  template <typename Visit>
  void for_each(Visit visit) const {
    for (const Cell& cell : cells_) {
      for (std::uint32_t i = cell.begin; i < cell.end; ++i) visit(points_[i], i < cell.removed_end);
    }
  }

 private:
  // Points [begin, removed_end) have no kept neighbour yet, [removed_end, end) have one.
  struct Cell {
    VoxelKey key;
    std::uint32_t begin, removed_end, end;
  };
  static constexpr std::size_t kNearBits = std::size_t{1} << 26U;
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFU;

  // World coordinates far outside of 21-bit cells share the outermost ones; distances decide.
  static VoxelKey cell_at(const Eigen::Vector3f& p, float inverse_size) {
    const auto axis = [inverse_size](float value) {
      constexpr auto kLimit = static_cast<float>(kVoxelAxisLimit - 1);
      return floor_to_int(std::clamp(value * inverse_size, -kLimit, kLimit));
    };
    return pack({axis(p.x()), axis(p.y()), axis(p.z())});
  }
  template <typename Visit>
  static void for_corners(const Eigen::Vector3f& p, float reach, float inverse_size, Visit visit) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3f offset((corner & 1) != 0 ? reach : -reach,
                                   (corner & 2) != 0 ? reach : -reach,
                                   (corner & 4) != 0 ? reach : -reach);
      visit(cell_at(p + offset, inverse_size));
    }
  }
  static std::size_t near_bit(VoxelKey coarse) { return mix_bits(coarse) % kNearBits; }
  Cell* find(VoxelKey key);

  float neighbour_m_;
  float inverse_size_;
  std::vector<RemovedPoint> points_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> slots_;
  // One bit per coarse cell that holds a removed point, hashed: most kept points are far from
  // any removed one and cost a single look-up.
  std::vector<std::uint64_t> near_;
};

constexpr float kCoarseCells = 8.0F;

void RemovedGrid::finish() {
  std::sort(points_.begin(), points_.end(),
            [](const RemovedPoint& a, const RemovedPoint& b) { return a.cell < b.cell; });
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (cells_.empty() || cells_.back().key != points_[i].cell) {
      cells_.push_back({points_[i].cell, i, i, i});
    }
    cells_.back().removed_end = cells_.back().end = i + 1;
    for_corners(points_[i].position, neighbour_m_, inverse_size_ / kCoarseCells,
                [this](VoxelKey coarse) {
                  const std::size_t bit = near_bit(coarse);
                  near_[bit / 64] |= std::uint64_t{1} << (bit % 64);
                });
  }
  slots_.assign(std::bit_ceil(cells_.size() * 2 + 2), kEmpty);
  for (std::uint32_t c = 0; c < cells_.size(); ++c) {
    std::size_t slot = mix_bits(cells_[c].key) & (slots_.size() - 1);
    while (slots_[slot] != kEmpty) slot = (slot + 1) & (slots_.size() - 1);
    slots_[slot] = c;
  }
}

RemovedGrid::Cell* RemovedGrid::find(VoxelKey key) {
  std::size_t slot = mix_bits(key) & (slots_.size() - 1);
  for (; slots_[slot] != kEmpty; slot = (slot + 1) & (slots_.size() - 1)) {
    if (cells_[slots_[slot]].key == key) return &cells_[slots_[slot]];
  }
  return nullptr;
}

void RemovedGrid::mark_kept(const Eigen::Vector3f& kept) {
  const std::size_t bit = near_bit(cell_at(kept, inverse_size_ / kCoarseCells));
  if ((near_[bit / 64] >> (bit % 64) & 1U) == 0) return;
  const float limit = neighbour_m_ * neighbour_m_;
  for_corners(kept, neighbour_m_, inverse_size_, [&](VoxelKey key) {
    Cell* cell = find(key);
    if (cell == nullptr) return;
    for (std::uint32_t i = cell->begin; i < cell->removed_end;) {
      if ((points_[i].position - kept).squaredNorm() > limit) {
        ++i;
        continue;
      }
      std::swap(points_[i], points_[--cell->removed_end]);
    }
  });
}

/// The points of a scan that the benchmark considers, in world coordinates.
template <typename Visit>
void for_points(const ScoredScan& scan, const Eigen::Vector3d& origin, float max_range_m,
                Visit visit) {
  Pose T_origin_sensor = scan.T_world_sensor;
  T_origin_sensor.translation -= origin;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const float range = scan.points[i].norm();
    if (!(range < max_range_m)) continue;  // NaN too
    const Eigen::Vector3d position = T_origin_sensor * scan.points[i].cast<double>();
    visit(i, Eigen::Vector3f(position.cast<float>()), range);
  }
}

class BenchmarkRun {
 public:
  BenchmarkRun(ScanSource& source, const BenchmarkConfig& config)
      : source_(source), config_(config), grid_(config.neighbour_m) {
    if (source.scan_count() > 0) origin_ = source.scan(0).T_world_sensor.translation;
  }

  BenchmarkScore run() {
    for (std::size_t s = 0; s < source_.scan_count(); ++s) {
      collect(source_.scan(s));
      if (grid_.size() >= config_.batch_points) score_batch();
    }
    score_batch();
    return result_;
  }

 private:
  // Scores the kept points of a scan and remembers the removed ones.
  void collect(const ScoredScan& scan) {
    for_points(scan, origin_, config_.max_range_m,
               [&](std::size_t i, const Eigen::Vector3f& position, float range) {
                 if (is_removed(scan.predicted[i])) {
                   grid_.add({0, position, range, scan.truth[i]});
                 } else {
                   count(scan.truth[i], range, false);
                 }
               });
  }

  // Streams every kept point past the removed ones and scores what stays removed.
  void score_batch() {
    if (grid_.size() == 0) return;
    grid_.finish();
    for (std::size_t s = 0; s < source_.scan_count(); ++s) {
      const ScoredScan scan = source_.scan(s);
      for_points(scan, origin_, config_.max_range_m,
                 [&](std::size_t i, const Eigen::Vector3f& position, float) {
                   if (!is_removed(scan.predicted[i])) grid_.mark_kept(position);
                 });
    }
    grid_.for_each([this](const RemovedPoint& point, bool still_removed) {
      count(point.truth, point.range_m, still_removed);
    });
    grid_.clear();
  }

  void count(std::uint32_t label, float range_m, bool removed) {
    result_.score.add(label, range_m, removed);
    Truth truth = truth_of(label);
    if (truth == Truth::kIgnored) {
      truth = range_m < config_.ego_range_m ? Truth::kDynamic : Truth::kStatic;
    }
    result_.with_unlabelled.add(truth, removed);
  }

  ScanSource& source_;
  const BenchmarkConfig& config_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  RemovedGrid grid_;
  BenchmarkScore result_;
};

}  // namespace

BenchmarkScore score_benchmark(ScanSource& source, const BenchmarkConfig& config) {
  return BenchmarkRun(source, config).run();
}

}  // namespace unimapper::evaluate
