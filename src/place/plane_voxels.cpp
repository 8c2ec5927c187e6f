#include "plane_voxels.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cell_steps.hpp"
#include "src/core/symmetric_eigen.hpp"
#include "src/core/voxel_key.hpp"

namespace unimapper::place {
namespace {

// A coarse voxel with at least so many cells may be a plane, and is one if their variance along its
// normal is below this, square metres: both as STD has them.
constexpr std::uint32_t kPlaneMinCells = 10;
constexpr float kPlaneMaxVarianceM2 = 0.01F;
// A plane extends in two directions: the middle eigenvalue is at least this share of the largest,
// otherwise the voxel is linear (a pole, a wire) and its normal would be arbitrary.
constexpr double kMinSpreadRatio = 0.05;
// ... and the smallest at most this share of the middle one, otherwise the voxel is not planar.
constexpr double kMaxFlatRatio = 0.25;
// Moments are in 1/512 of a voxel's size.
constexpr std::int32_t kStepBits = 9;
constexpr float kSteps = 512.0F;
// Voxels are counted from so many below the origin, which is farther than any cell lies.
constexpr std::int32_t kOrigin = 512;
constexpr float kOriginVoxels = 512.0F;

// A total order on patches, so that selection does not depend on the order they were found in.
bool comes_first(const PlanePatch& a, const PlanePatch& b) noexcept {
  if (is_upright(a.normal) != is_upright(b.normal)) return is_upright(a.normal);
  const float da = a.center.squaredNorm();
  const float db = b.center.squaredNorm();
  if (da != db) return da < db;
  for (int axis = 0; axis < 3; ++axis) {
    if (a.center(axis) != b.center(axis)) return a.center(axis) < b.center(axis);
  }
  return false;
}

}  // namespace

void PlaneVoxels::allocate(Arena& arena, const DescriptorConfig& config,
                           float voxel_size_m) noexcept {
  voxel_size_m_ = voxel_size_m;
  planes_.allocate(arena, config.max_planes);
}

void PlaneVoxels::allocate_scratch(Arena& arena, const DescriptorConfig& config) noexcept {
  voxels_.allocate(arena, config.max_voxels);
  all_.allocate(arena, config.max_voxels);
  order_.allocate(arena, config.max_voxels);
}

void PlaneVoxels::begin() noexcept {
  dropped_ = 0;
  voxels_.reset();
  all_.clear();
  order_.clear();
  planes_.clear();
  run_voxel_ = {};
  run_ = {};
  recent_ = {};
  fitted_ = 0;
}

// Cells that follow each other mostly lie in one voxel: their moments are summed up before they are
// added to the table.
void PlaneVoxels::collect(std::span<const FineCell> structure) noexcept {
  const CellSteps grid(kSteps / voxel_size_m_, kOriginVoxels * kSteps);
  VoxelIndex current = run_voxel_;
  Moments run = run_;
  for (const FineCell& cell : structure) {
    const CellSteps::Steps at = grid.of(cell);
    const VoxelIndex index{at.x >> kStepBits, at.y >> kStepBits, at.z >> kStepBits};
    if (!(index == current)) {
      add(current, run);
      current = index;
      run = {};
    }
    constexpr std::int32_t kWithin = (1 << kStepBits) - 1;
    const auto x = static_cast<std::uint32_t>(at.x & kWithin);
    const auto y = static_cast<std::uint32_t>(at.y & kWithin);
    const auto z = static_cast<std::uint32_t>(at.z & kWithin);
    ++run.count;
    run.sum[0] += x;
    run.sum[1] += y;
    run.sum[2] += z;
    run.product[0] += x * x;
    run.product[1] += x * y;
    run.product[2] += x * z;
    run.product[3] += y * y;
    run.product[4] += y * z;
    run.product[5] += z * z;
    // A voxel takes no more, and no sum may overflow before that is checked.
    if (run.count == kMaxCells) {
      add(current, run);
      run = {};
    }
  }
  run_voxel_ = current;
  run_ = run;
}

void PlaneVoxels::add(const VoxelIndex& steps, const Moments& run) noexcept {
  if (run.count == 0) return;
  const VoxelIndex index{steps.x - kOrigin, steps.y - kOrigin, steps.z - kOrigin};
  const std::uint32_t entry =
      recent_.entry(index, [this](VoxelKey key) { return voxels_.find_or_insert(key); });
  if (entry == FixedHashMap<Voxel>::kNotFound ||
      voxels_[entry].moments.count + run.count > kMaxCells) {
    dropped_ += run.count;
    return;
  }
  Moments& moments = voxels_[entry].moments;
  moments.count += run.count;
  for (int i = 0; i < 3; ++i) moments.sum[i] += run.sum[i];
  for (int i = 0; i < 6; ++i) moments.product[i] += run.product[i];
}

bool PlaneVoxels::fit(const Moments& moments, std::uint64_t key, PlanePatch& patch) const noexcept {
  if (moments.count < kPlaneMinCells) return false;
  const double n = moments.count;
  const double step_m = static_cast<double>(voxel_size_m_) / static_cast<double>(kSteps);
  const Eigen::Vector3d mean(static_cast<double>(moments.sum[0]) / n,
                             static_cast<double>(moments.sum[1]) / n,
                             static_cast<double>(moments.sum[2]) / n);
  Eigen::Matrix3d covariance;
  int k = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column, ++k) {
      covariance(row, column) =
          static_cast<double>(moments.product[k]) / n - mean(row) * mean(column);
      covariance(column, row) = covariance(row, column);
    }
  }
  covariance *= step_m * step_m;
  // Most non-planar voxels extend in all directions. The smallest eigenvalue is the determinant
  // over the product of the others, which is at most a quarter of the trace squared.
  const double half_trace = 0.5 * covariance.trace();
  constexpr auto kMaxVariance = static_cast<double>(kPlaneMaxVarianceM2);
  if (!(covariance.determinant() < kMaxVariance * half_trace * half_trace)) return false;
  const SymmetricEigen<double> eigen = symmetric_eigen<double>(covariance);
  if (!(eigen.values(0) < kMaxVariance)) return false;
  if (!(eigen.values(1) > kMinSpreadRatio * eigen.values(2))) return false;
  if (!(eigen.values(0) < kMaxFlatRatio * eigen.values(1))) return false;

  const VoxelIndex index = unpack(key);
  const Eigen::Vector3f corner =
      Eigen::Vector3f(static_cast<float>(index.x), static_cast<float>(index.y),
                      static_cast<float>(index.z)) *
      voxel_size_m_;
  // A step's content lies half a step above its lower edge on average.
  patch.center = corner + ((mean.array() + 0.5) * step_m).matrix().cast<float>();
  patch.normal = eigen.vectors.col(0).cast<float>().normalized();
  // Towards the sensor, which is the origin of the frame.
  if (patch.normal.dot(patch.center) > 0.0F) patch.normal = -patch.normal;
  return true;
}

// Planes lie in the order of their voxels. Each is fitted where it lies if all voxels are planes,
// then they close up.
bool PlaneVoxels::fit_some(std::uint32_t voxels, const Executor& executor) noexcept {
  add(run_voxel_, std::exchange(run_, {}));
  const Slice some{fitted_, fitted_ + std::min(voxels, unfitted())};
  constexpr std::uint32_t kVoxelsPerPart = 64;
  for_slices(executor, some, kVoxelsPerPart, [&](Slice part, std::uint32_t) noexcept {
    for (std::uint32_t i = part.first; i < part.end; ++i) {
      voxels_[i].plane = fit(voxels_[i].moments, voxels_.key(i), all_.data()[i]) ? 1 : 0;
    }
  });
  for (std::uint32_t i = some.first; i < some.end; ++i) {
    if (voxels_[i].plane == 0) continue;
    all_.push_back(all_.data()[i]);
    order_.push_back(static_cast<std::uint32_t>(all_.size() - 1));
    voxels_[i].plane = static_cast<std::uint32_t>(all_.size());
  }
  fitted_ = some.end;
  return unfitted() > 0;
}

void PlaneVoxels::select(const LocalGround& ground) noexcept {
  ground.for_each_plane(static_cast<std::int32_t>(kPlaneMinCells), [this](const PlanePatch& patch) {
    if (!all_.push_back(patch)) return;
    order_.push_back(static_cast<std::uint32_t>(all_.size() - 1));
  });
  std::sort(order_.begin(), order_.end(),
            [this](std::uint32_t a, std::uint32_t b) { return comes_first(all_[a], all_[b]); });
  for (const std::uint32_t i : order_) {
    if (!planes_.push_back(all_[i])) ++dropped_;
  }
}

Eigen::Vector3f PlaneVoxels::bordering_normal(const Eigen::Vector3f& position) const noexcept {
  const VoxelIndex center = voxel_index(position, 1.0F / voxel_size_m_);
  const PlanePatch* best = nullptr;
  float best_distance = 0.0F;
  for (std::int32_t dz = -1; dz <= 1; ++dz) {
    for (std::int32_t dy = -1; dy <= 1; ++dy) {
      for (std::int32_t dx = -1; dx <= 1; ++dx) {
        const std::uint32_t entry =
            voxels_.find(pack({center.x + dx, center.y + dy, center.z + dz}));
        if (entry == FixedHashMap<Voxel>::kNotFound || voxels_[entry].plane == 0) continue;
        const PlanePatch& patch = all_[voxels_[entry].plane - 1];
        if (!is_upright(patch.normal)) continue;
        const float distance = (patch.center - position).squaredNorm();
        if (best != nullptr && !(distance < best_distance)) continue;
        best = &patch;
        best_distance = distance;
      }
    }
  }
  return best == nullptr ? Eigen::Vector3f(Eigen::Vector3f::UnitZ()) : best->normal;
}

}  // namespace unimapper::place
