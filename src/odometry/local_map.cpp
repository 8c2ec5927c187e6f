#include "local_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/core/symmetric_eigen.hpp"

namespace unimapper::odometry {
namespace {

constexpr int kCells = 4;  // along each edge of a voxel; 64 of them fit a word

/// Floor of each coordinate; a pose that has gone astray must not overflow an integer.
VoxelIndex index_of(const Eigen::Vector3d& scaled) noexcept {
  const auto axis = [](double value) {
    constexpr double kMost = 1e9;
    return floor_to<std::int32_t>(std::min(kMost, std::max(-kMost, value)));
  };
  return {axis(scaled.x()), axis(scaled.y()), axis(scaled.z())};
}

Eigen::Vector3d middle_of(const VoxelIndex& index) noexcept {
  return {index.x + 0.5, index.y + 0.5, index.z + 0.5};
}

int cell_of(double inside) noexcept {
  return static_cast<int>(std::min(kCells - 1.0, std::max(0.0, inside * kCells)));
}

void add_outer_product(const Eigen::Vector3f& v, float upper[6]) noexcept {
  upper[0] += v.x() * v.x();
  upper[1] += v.x() * v.y();
  upper[2] += v.x() * v.z();
  upper[3] += v.y() * v.y();
  upper[4] += v.y() * v.z();
  upper[5] += v.z() * v.z();
}

Eigen::Matrix3f covariance_of(const MapVoxel& voxel, const Eigen::Vector3f& mean_m) noexcept {
  const float share = 1.0F / static_cast<float>(voxel.points);
  const float* const p = voxel.products_m2;
  Eigen::Matrix3f covariance;
  covariance << p[0], p[1], p[2], p[1], p[3], p[4], p[2], p[4], p[5];
  return covariance * share - mean_m * mean_m.transpose();
}

/// Of points that fill the voxel along a direction nothing shows where they are along it: they move
/// along with the sensor's pattern.
void set_cluster(const SymmetricEigen<float>& eigen, float compact_m2, Surface& surface) noexcept {
  constexpr float kPlane_m2 = 0.05F * 0.05F;
  for (int i = 0; i < 3; ++i) {
    const float variance_m2 = eigen.values(i);
    if (!(variance_m2 <= compact_m2)) continue;
    const float share = std::sqrt(kPlane_m2 / (kPlane_m2 + variance_m2));
    add_outer_product(share * eigen.vectors.col(i), surface.across);
    surface.is_cluster = true;
  }
}

}  // namespace

void LocalMap::allocate(Arena& arena, std::size_t voxels, double voxel_m,
                        double compact_m) noexcept {
  voxels_.allocate(arena, voxels);
  voxel_m_ = voxel_m;
  per_m_ = 1.0 / voxel_m;
  compact_m2_ = static_cast<float>(compact_m * compact_m);
}

void LocalMap::clear() noexcept {
  voxels_.clear();
  cursor_ = 0;
}

bool LocalMap::add(const Eigen::Vector3d& point_m) noexcept {
  const Eigen::Vector3d scaled = point_m * per_m_;
  const VoxelIndex index = index_of(scaled);
  const std::uint32_t entry = voxels_.find_or_insert(pack(index));
  if (entry == kNone) return false;
  MapVoxel& voxel = voxels_[entry];
  const Eigen::Vector3d from_middle = scaled - middle_of(index);
  const int cell = cell_of(from_middle.x() + 0.5) + kCells * cell_of(from_middle.y() + 0.5) +
                   kCells * kCells * cell_of(from_middle.z() + 0.5);
  const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(cell);
  if ((voxel.filled & bit) != 0) return true;
  voxel.filled |= bit;
  const Eigen::Vector3f p = (from_middle * voxel_m_).cast<float>();
  voxel.sum_m += p;
  add_outer_product(p, voxel.products_m2);
  ++voxel.points;
  voxel.is_changed = true;
  return true;
}

void LocalMap::forget_far(const Eigen::Vector3d& centre_m, double radius_m) noexcept {
  constexpr std::uint32_t kCalls = 16;
  const std::uint32_t looks = voxels_.size() / kCalls + 1;
  const double radius_m2 = radius_m * radius_m;
  for (std::uint32_t i = 0; i < looks && voxels_.size() > 0; ++i) {
    if (cursor_ >= voxels_.size()) cursor_ = 0;
    if ((centre(cursor_) - centre_m).squaredNorm() > radius_m2) {
      voxels_.erase(cursor_);
    } else {
      ++cursor_;
    }
  }
}

Eigen::Vector3d LocalMap::centre(std::uint32_t entry) const noexcept {
  return middle_of(unpack(voxels_.key(entry))) * voxel_m_;
}

void LocalMap::update_surface(MapVoxel& voxel) const noexcept {
  constexpr std::uint16_t kFewest = 8;
  constexpr std::uint16_t kFewestClear = 10;
  constexpr std::uint16_t kFewestCluster = 12;
  // Two bare planes that meet fill half of the sub-cells at most.
  constexpr std::uint16_t kFewestClearCluster = 26;
  constexpr float kSpread = 0.12F;      // standard deviation along the surface, in voxels
  constexpr float kSpreadClear = 0.2F;  // a full plane has 0.29
  constexpr float kFlat = 0.1F;         // variance across a plane, of that along it
  constexpr float kFlatClear = 0.03F;   // the same
  constexpr float kThin = 0.04F;        // variance across a pole, of that along it
  constexpr float kUpright = 0.9F;      // lines that lie are a ring of the sensor, and no pole
  voxel.is_changed = false;
  voxel.is_surface = false;
  if (voxel.points < kFewest) return;
  Surface& surface = voxel.surface;
  surface.mean_m = voxel.sum_m / static_cast<float>(voxel.points);
  const SymmetricEigen<float> eigen = symmetric_eigen(covariance_of(voxel, surface.mean_m));
  const auto variance_of = [this](float spread) {
    const float deviation_m = spread * static_cast<float>(voxel_m_);
    return deviation_m * deviation_m;
  };
  const bool is_many = voxel.points >= kFewestClear;
  const Eigen::Vector3f& v = eigen.values;
  for (float& element : surface.across) element = 0.0F;
  surface.is_cluster = false;
  if (v(1) >= variance_of(kSpread) && v(0) > kFlat * v(1)) {
    if (voxel.points >= kFewestCluster) set_cluster(eigen, compact_m2_, surface);
    surface.is_clear = voxel.points >= kFewestClearCluster;
    voxel.is_surface = surface.is_cluster;
    return;
  }
  if (v(1) >= variance_of(kSpread)) {
    add_outer_product(eigen.vectors.col(0), surface.across);
    surface.is_clear = is_many && v(0) <= kFlatClear * v(1) && v(1) >= variance_of(kSpreadClear);
  } else {
    const bool is_pole = v(2) >= variance_of(kSpread) && v(1) <= kThin * v(2) &&
                         std::abs(eigen.vectors(2, 2)) > kUpright;
    if (!is_pole) return;
    add_outer_product(eigen.vectors.col(0), surface.across);
    add_outer_product(eigen.vectors.col(1), surface.across);
    surface.is_clear = is_many;
  }
  voxel.is_surface = true;
}

void LocalMap::look(const Eigen::Vector3d& scaled, const Eigen::Vector3d& from,
                    Neighbourhood& neighbourhood) noexcept {
  const VoxelIndex lowest = index_of(from);
  neighbourhood = {kNone, lowest};
  float least_m2 = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 8; ++i) {
    const VoxelIndex index{lowest.x + i % 2, lowest.y + i / 2 % 2, lowest.z + i / 4};
    const std::uint32_t entry = voxels_.find(pack(index));
    if (entry == kNone) continue;
    MapVoxel& voxel = voxels_[entry];
    if (voxel.is_changed) update_surface(voxel);
    if (!voxel.is_surface) continue;
    const Eigen::Vector3f from_centre = ((scaled - middle_of(index)) * voxel_m_).cast<float>();
    const float distance_m2 = (from_centre - voxel.surface.mean_m).squaredNorm();
    if (distance_m2 < least_m2) {
      least_m2 = distance_m2;
      neighbourhood.entry = entry;
    }
  }
}

}  // namespace unimapper::odometry
